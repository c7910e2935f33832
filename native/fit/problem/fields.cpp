// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/problem/fields.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "math/overloaded.h"
#include "math/problem_list.h"
#include "render/shape/shape_gradient.h"
#include "scene/shader/image_use.h"

namespace selenite {
namespace {

using Shape = std::vector<std::ptrdiff_t>;

const Mesh& mesh_of(const Scene& scene, const VerticesRef& ref) {
  const Geometry& geometry = *scene.geometry;
  const Instance& instance = geometry.instances()[static_cast<std::size_t>(ref.instance)];
  return geometry.meshes()[static_cast<std::size_t>(instance.mesh)];
}

/// Refused: the material has no such grid.
const Grid& grid_of(const Scene& scene, const GridRef& ref) {
  const Material& material = scene.appearance.materials[static_cast<std::size_t>(ref.material)];
  if (!material.grid(ref.kind))
    throw Refused(material.name + ":" + grid_name(ref.kind), "the material has no such grid",
                  std::string("give it one, or fit its ") +
                      (ref.kind == GridKind::kAlbedo ? "albedo" : "extinction"));
  return *material.grid(ref.kind).grid;
}

Shape own_shape(const Scene& scene, const GridRef& ref) {
  const Grid& grid = grid_of(scene, ref);
  const auto& [nx, ny, nz] = grid.size();
  return {nz, ny, nx, grid.channels()};
}

Shape own_shape(const Scene& scene, const ImageRef& ref) {
  const Texture& image = *scene.image(ref).texture;
  return {image.height(), image.width(), scene.channels(ref)};
}

Shape own_shape(const Scene& scene, const EnvironmentRef&) {
  const EnvironmentMap& image = scene.environment();
  return {image.height(), image.width(), 3};
}

Shape own_shape(const Scene& scene, const VertexColorsRef& ref) {
  return {std::ssize(scene.vertex_colors(ref).values()), 3};
}

Shape own_shape(const Scene& scene, const VerticesRef& ref) {
  return {std::ssize(mesh_of(scene, ref).positions), 3};
}

/// A grid or an image as a row of numbers.
struct Numbers {
  std::string title;  ///< "grid 'smoke'"
  double most;        ///< largest that is permitted
  Vector values;
  std::shared_ptr<const Texture> image;    ///< none: a grid or a mesh
  std::shared_ptr<const MeshGraph> graph;  ///< of a mesh
};

Vector vector_of(const float* first, std::size_t count) {
  return Eigen::Map<const Eigen::VectorXf>(first, static_cast<Eigen::Index>(count)).cast<double>();
}

Numbers numbers_of(const Scene& scene, const GridRef& ref) {
  const Grid& grid = grid_of(scene, ref);
  // The renderer counts in single precision.
  const double most =
      ref.kind == GridKind::kAlbedo ? 1 : static_cast<double>(std::numeric_limits<float>::max());
  return {"grid '" + grid.name() + "'", most, vector_of(grid.values().data(), grid.values().size()),
          nullptr, nullptr};
}

Numbers numbers_of(const Scene& scene, const ImageRef& ref) {
  const auto& image = scene.image(ref).texture;
  static_assert(sizeof(Colorf) == 3 * sizeof(float));
  Vector values = vector_of(&image->pixels()[0].r, 3 * image->pixels().size());
  if (scene.channels(ref) == 1) values = Vector(values(Eigen::seq(0, Eigen::last, Eigen::fix<3>)));
  return {"image '" + image->name() + "'", 1, std::move(values), image, nullptr};
}

Numbers numbers_of(const Scene& scene, const EnvironmentRef&) {
  const EnvironmentMap& image = scene.environment();
  return {"the image of the world", static_cast<double>(std::numeric_limits<float>::max()),
          vector_of(&image.pixels()[0].r, 3 * image.pixels().size()), nullptr, nullptr};
}

Numbers numbers_of(const Scene& scene, const VertexColorsRef& ref) {
  const VertexColors& colors = scene.vertex_colors(ref);
  const std::vector<Colorf>& values = colors.values();
  return {"colour attribute '" + colors.attribute() + "'", 1,
          vector_of(&values[0].r, 3 * values.size()), nullptr,
          std::make_shared<const MeshGraph>(
              colors, scene.geometry->meshes()[static_cast<std::size_t>(ref.mesh)])};
}

Numbers numbers_of(const Scene& scene, const VerticesRef& ref) {
  const Geometry& geometry = *scene.geometry;
  const Instance& instance = geometry.instances()[static_cast<std::size_t>(ref.instance)];
  const auto& positions = mesh_of(scene, ref).positions;
  Vector values(3 * std::ssize(positions));
  for (std::size_t v = 0; v < positions.size(); ++v) {
    const Vec3d p = geometry.to_object(ref.instance).point(Vec3d(positions[v]));
    values.segment<3>(3 * static_cast<Eigen::Index>(v)) << p.x, p.y, p.z;
  }
  return {"the mesh of '" + instance.name + "'",
          static_cast<double>(std::numeric_limits<float>::max()), std::move(values), nullptr,
          nullptr};
}

/// The same of vertices, whose bounds say how far the ends of their box move, and whose rate is a
/// part of its diagonal.
void check_vertices(const std::string& name, const UnknownParameter& one) {
  constexpr double kFarthest = 100;
  ProblemList problems;
  if (!(one.minimum <= 0 && one.maximum >= 0 && one.minimum >= -kFarthest &&
        one.maximum <= kFarthest))
    problems.add({name, joined("its bounds are [", one.minimum, ", ", one.maximum, "]"),
                  "give numbers around 0 in [-100, 100]"});
  if (!one.start.empty())
    problems.add({name, joined("start has ", one.start.size(), " values"),
                  "it starts at the mesh that the scene has: leave start out"});
  if (!(one.learning_rate > 0 && one.learning_rate <= 1))
    problems.add({name, joined("its learning rate is ", one.learning_rate),
                  "give a number above 0 and at most 1"});
  problems.raise();
}

/// InvalidArgument unless bounds, start and rate are good.
void check(const std::string& name, const UnknownParameter& one, const Numbers& numbers) {
  const bool share = numbers.most == 1;
  if (!(one.minimum >= 0 && one.minimum < one.maximum && one.maximum <= numbers.most))
    throw Refused(name,
                  joined("bounds [", one.minimum, ", ", one.maximum, "] are no interval ",
                         share ? "inside [0, 1]" : "of finite numbers from 0 up"),
                  share ? "give bounds inside" : "give bounds such as [0, 10]");
  if (!one.start.empty())
    throw Refused(name, joined("start has ", one.start.size(), " values"),
                  "it starts at the values that the scene has: leave start out");
  if (!(one.learning_rate > 0) || !std::isfinite(one.learning_rate))
    throw Refused(name,
                  joined("learning_rate = ", one.learning_rate, " must be above 0 and finite"),
                  share ? "0.03 is usual" : "0.03 of a usual density is usual");
  for (const double x : numbers.values)
    if (!(x >= one.minimum && x <= one.maximum))
      throw Refused(name,
                    joined(numbers.title, " holds ", x, ", outside its bounds [", one.minimum, ", ",
                           one.maximum, "]"),
                    "clamp it or widen the bounds");
}

bool is_environment(const UnknownParameter& one) {
  return one.owner == kWorldName && one.parameter == kEnvironment;
}

std::optional<GridKind> grid_kind(const std::string& name) {
  for (const GridKind kind : {GridKind::kAlbedo, GridKind::kDensity})
    if (name == grid_name(kind)) return kind;
  return std::nullopt;
}

/// `channels`: 1 of grey.
std::vector<Colorf> colours(const Eigen::VectorXf& values, int channels = 3) {
  if (channels == 1) return {values.begin(), values.end()};
  static_assert(sizeof(Colorf) == 3 * sizeof(float));
  std::vector<Colorf> pixels(static_cast<std::size_t>(values.size()) / 3);
  Eigen::Map<Eigen::VectorXf>(&pixels[0].r, values.size()) = values;
  return pixels;
}

Scene with_values(const Scene& scene, const GridRef& ref, const Eigen::VectorXf& values) {
  return scene.with_grid(ref, std::vector<float>(values.begin(), values.end()));
}

Scene with_values(const Scene& scene, const ImageRef& ref, const Eigen::VectorXf& values) {
  return scene.with_image(ref, colours(values, scene.channels(ref)));
}

Scene with_values(const Scene& scene, const EnvironmentRef&, const Eigen::VectorXf& values) {
  return scene.with_environment(colours(values));
}

Scene with_values(const Scene& scene, const VertexColorsRef& ref, const Eigen::VectorXf& values) {
  return scene.with_vertex_colors(ref, colours(values));
}

/// Corners that share a normal go on sharing it.
Scene with_values(const Scene& scene, const VerticesRef& ref, const Eigen::VectorXf& values) {
  const Geometry& geometry = *scene.geometry;
  const Instance& instance = geometry.instances()[static_cast<std::size_t>(ref.instance)];
  std::vector<Vec3f> positions;
  for (Eigen::Index i = 0; i < values.size(); i += 3)
    positions.emplace_back(
        instance.to_world.point(Vec3d(Vec3f{values[i], values[i + 1], values[i + 2]})));
  return with_vertices(scene, ref.instance, VertexNormals(mesh_of(scene, ref)), positions);
}

/// Whether it is an image of a node whose colours encode unit vectors.
bool holds_normals(const Scene& scene, const FittedFieldRef& ref) {
  const auto* const image = std::get_if<ImageRef>(&ref);
  const int own = image ? shader_constant(image->field) : -1;
  if (own < 0) return false;
  const Material& material = scene.appearance.materials[static_cast<std::size_t>(image->material)];
  return material.shader &&
         encodes_normals(*material.shader,
                         material.images[static_cast<std::size_t>(own)].map.field);
}

}  // namespace

FittedFieldRef field_named(const Scene& scene, const std::string& owner,
                           const std::string& parameter) {
  if (owner == kWorldName && parameter == kEnvironment) return EnvironmentRef{};
  if (parameter == kVertexColors)
    return VertexColorsRef{
        scene.geometry->instances()[static_cast<std::size_t>(scene.object(owner))].mesh};
  if (parameter == kVertexPositions) return VerticesRef{movable_object(scene, owner)};
  const int material = scene.material(owner);
  if (const auto kind = grid_kind(parameter)) return GridRef{material, *kind};
  return scene.image_named(material, parameter);
}

std::vector<std::ptrdiff_t> shape_of(const Scene& scene, const FittedFieldRef& ref) {
  return std::visit([&](const auto& one) { return own_shape(scene, one); }, ref);
}

Scene with_field(const Scene& scene, const FittedFieldRef& ref, const Eigen::VectorXf& values) {
  return std::visit([&](const auto& one) { return with_values(scene, one, values); }, ref);
}

std::optional<FieldRef> carried(const FittedFieldRef& ref) {
  return std::visit(
      Overloaded{[](const auto& one) -> std::optional<FieldRef> { return FieldRef(one); },
                 [](const VerticesRef&) -> std::optional<FieldRef> { return std::nullopt; }},
      ref);
}

Eigen::VectorXd sphere_shares(const std::vector<std::ptrdiff_t>& shape) {
  const Eigen::ArrayXd rows =
      Eigen::ArrayXd::LinSpaced(shape[0], 0.5, static_cast<double>(shape[0]) - 0.5);
  const Eigen::VectorXd sines = (rows * (kPi<double> / static_cast<double>(shape[0]))).sin();
  Eigen::VectorXd shares(shape[0] * shape[1]);
  for (Eigen::Index y = 0; y < shape[0]; ++y)
    shares.segment(y * shape[1], shape[1]).setConstant(sines[y]);
  return shares / shares.sum();
}

bool Fields::is_field(const UnknownParameter& one) {
  return selenite::is_environment(one) || one.parameter == kVertexColors ||
         one.parameter == kVertexPositions || grid_kind(one.parameter) ||
         is_image_name(one.parameter);
}

Fields::Fields(const Scene& scene, const std::vector<UnknownParameter>& wanted) {
  ProblemList problems;
  for (const UnknownParameter& one : wanted)
    if (is_field(one)) problems.collect([&] { add(scene, one); });
  problems.raise();
}

void Fields::add(const Scene& scene, const UnknownParameter& one) {
  const std::string name = one.name();
  const FittedFieldRef ref = field_named(scene, one.owner, one.parameter);
  if (std::find(refs_.begin(), refs_.end(), ref) != refs_.end())
    throw Refused("", name + " is listed twice", "list it once");
  Numbers numbers = std::visit([&](const auto& r) { return numbers_of(scene, r); }, ref);
  if (std::holds_alternative<VerticesRef>(ref))
    check_vertices(name, one);
  else
    check(name, one, numbers);
  refs_.push_back(ref);
  names_.push_back(name);
  wanted_.push_back(one);
  shapes_.push_back(shape_of(scene, ref));
  images_.push_back(std::move(numbers.image));
  normals_.push_back(holds_normals(scene, ref));
  graphs_.push_back(std::move(numbers.graph));
  start_.push_back(std::move(numbers.values));
}

bool Fields::acts_by_channel(std::size_t field) const {
  const auto* const image = std::get_if<ImageRef>(&refs_[field]);
  return image && shader_constant(image->field) < 0 && channels(field) == 3;
}

std::vector<FieldRef> Fields::carried() const {
  std::vector<FieldRef> found;
  for (const FittedFieldRef& ref : refs_)
    if (const auto one = selenite::carried(ref)) found.push_back(*one);
  return found;
}

const VerticesRef* Fields::vertices() const {
  for (const FittedFieldRef& one : refs_)
    if (const auto* found = std::get_if<VerticesRef>(&one)) return found;
  return nullptr;
}

Scene Fields::scene_with_field(const Scene& scene, std::size_t field, const Vector& values) const {
  return with_field(scene, refs_[field], values.cast<float>());
}

Scene Fields::scene_with(const Scene& scene, const FieldValues& values) const {
  Scene changed = scene;
  for (std::size_t f = 0; f < refs_.size(); ++f) changed = scene_with_field(changed, f, values[f]);
  return changed;
}

std::vector<Color<double>> Fields::means(const FieldValues& values) const {
  std::vector<Color<double>> means;
  for (std::size_t f = 0; f < refs_.size(); ++f) means.push_back(mean(f, values[f]));
  return means;
}

Color<double> Fields::mean(std::size_t field, const Vector& values) const {
  const int n = channels(field);
  const Texture* const image = images_[field].get();
  const double even = static_cast<double>(n) / static_cast<double>(values.size());
  Eigen::VectorXd shares;
  if (is_environment(field)) shares = sphere_shares(shapes_[field]);
  Color<double> sum;
  for (Eigen::Index i = 0; i < values.size(); i += n) {
    const Color<double> stored(values[i], values[i + 1 % n], values[i + 2 % n]);
    sum += (image ? Color<double>(image->decode(Colorf(stored))) : stored) *
           (shares.size() > 0 ? shares[i / n] : even);
  }
  return sum;
}

/// Values of places that no photo shows stay as they were.
Vector Fields::evened(std::size_t field, const Vector& values) const {
  const int n = channels(field);
  const Texture* const image = images_[field].get();
  const auto at = [&](Eigen::Index i) {
    const Color<double> stored(values[i], values[i + 1 % n], values[i + 2 % n]);
    return image ? Color<double>(image->decode(Colorf(stored))) : stored;
  };
  Color<double> sum, moved;
  double count = 0;
  for (Eigen::Index i = 0; i < values.size(); i += n) {
    const Color<double> one = at(i);
    sum += one;
    if (values.segment(i, n) == start_[field].segment(i, n)) continue;
    moved += one;
    ++count;
  }
  const Color<double> mean =
      count > 0 ? moved * (1 / count) : sum * (n / static_cast<double>(values.size()));
  const Colorf stored = image ? image->encode(Colorf(mean)) : Colorf(mean);
  Vector even(values.size());
  for (Eigen::Index i = 0; i < even.size(); ++i)
    even[i] = std::clamp<double>(stored[static_cast<int>(i % n)], wanted_[field].minimum,
                                 wanted_[field].maximum);
  return even;
}

}  // namespace selenite
