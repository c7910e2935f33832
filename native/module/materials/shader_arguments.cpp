// SPDX-License-Identifier: GPL-3.0-or-later
#include "module/materials/shader_arguments.h"

#include <pybind11/stl.h>

#include <algorithm>
#include <map>

#include "module/arrays.h"
#include "module/one_of.h"
#include "scene/shader/modes.h"

namespace py = pybind11;

namespace selenite {
namespace {

constexpr std::pair<const char*, InstructionFlag> kFlagNames[] = {
    {"clamp_result", kClampResult}, {"clamp_factor", kClampFactor},
    {"per_channel", kPerChannel},   {"sorted", kSorted},
    {"extrapolate", kExtrapolate},  {"stepped", kStepped},
    {"inverted", kInverted},        {"colored", kColored}};

template <class T>
T value_or(const py::dict& values, const char* key, T otherwise) {
  return values.contains(key) ? values[key].cast<T>() : otherwise;
}

template <class Names>
int number_of(const Names& names, const std::string& name, const std::string& what) {
  const auto found = std::find(names.begin(), names.end(), name);
  if (found != names.end()) return static_cast<int>(found - names.begin());
  std::string known;
  for (const auto& other : names) known += " " + std::string(other);
  throw NotFound("", what + " '" + name + "' is none of" + known);
}

Colorf color_argument(const py::handle& value) {
  const auto numbers = value.cast<std::vector<float>>();
  if (numbers.size() == 1) return Colorf(numbers[0]);
  if (numbers.size() != 3)
    throw Refused("", "a shader's value has " + std::to_string(numbers.size()) + " numbers",
                  "give 1 or 3");
  return {numbers[0], numbers[1], numbers[2]};
}

class ShaderReader {
 public:
  ShaderReader(Material& material, const py::dict& values)
      : material_(material), values_(values), who_("Material '" + material.name + "'") {}

  void read(const std::vector<std::shared_ptr<const Texture>>& textures) {
    for (const auto& row : values_["constants"]) add_constant(row.cast<py::dict>());
    for (const auto& value : values_["literals"]) shader_.literals.push_back(color_argument(value));
    for (const auto& name : values_["names"]) shader_.names.push_back(name.cast<std::string>());
    for (const auto& index : values_["textures"]) {
      const int at = index.cast<int>();
      if (at < 0 || at >= static_cast<int>(textures.size()))
        throw Refused(who_, "shader: texture " + std::to_string(at) + " was not added");
      shader_.textures.push_back(textures[static_cast<std::size_t>(at)]);
    }
    for (const auto& table : values_["tables"]) add_table(table.cast<py::dict>());
    for (const auto& code : values_["code"]) add_code(code.cast<py::dict>());
    for (const auto& closure : values_["closures"]) add_closure(closure.cast<py::dict>());
    if (values_.contains("images"))
      for (const auto& image : values_["images"]) add_image(image.cast<py::dict>());
    material_.shader = finished(std::move(shader_), material_.name);
  }

 private:
  void add_image(const py::dict& row) {
    ShaderImage image;
    image.name = row["name"].cast<std::string>();
    image.channels = row["channels"].cast<int>();
    image.map.field = row["texture"].cast<int>();
    if (image.map.field < 0 || image.map.field >= static_cast<int>(shader_.textures.size()))
      throw Refused(
          who_, "shader: image " + std::to_string(image.map.field) + " is none of its textures");
    image.map.texture = shader_.textures[static_cast<std::size_t>(image.map.field)];
    image.map.attribute = row["attribute"].cast<std::string>();
    const auto uv = row["uv"].cast<Array<float>>();
    require_shape(uv, who_ + ": uv", {2, 3});
    std::copy(uv.data(), uv.data() + 6, image.map.uv.begin());
    material_.images.push_back(std::move(image));
  }

  void add_constant(const py::dict& row) {
    ShaderConstant constant;
    constant.texts = std::make_shared<const std::array<std::string, 3>>(
        std::array{row["name"].cast<std::string>(), row["unit"].cast<std::string>(),
                   row["help"].cast<std::string>()});
    Parameter& p = constant.parameter;
    p.name = (*constant.texts)[0];
    p.unit = (*constant.texts)[1];
    p.help = (*constant.texts)[2];
    p.lower = row["lower"].cast<double>();
    p.upper = row["upper"].cast<double>();
    p.fit_lower = row["fit_lower"].cast<double>();
    p.fit_upper = row["fit_upper"].cast<double>();
    p.scale = one_of<Scale>(prefix() + "scale", row["scale"].cast<std::string>(),
                            {{"linear", Scale::kLinear},
                             {"log", Scale::kLog},
                             {"log_excess", Scale::kLogExcess},
                             {"roughness", Scale::kRoughness},
                             {"reflectance", Scale::kReflectance},
                             {"angle", Scale::kAngle}});
    p.effect = one_of<Effect>(prefix() + "effect", row["effect"].cast<std::string>(),
                              {{"surface", Effect::kSurface},
                               {"emission", Effect::kEmission},
                               {"volume", Effect::kVolume},
                               {"visibility", Effect::kVisibility}});
    const auto value = row["value"].cast<std::vector<double>>();
    if (value.size() != 1 && value.size() != 3)
      throw Refused(
          who_,
          "shader: " + std::string(p.name) + " has " + std::to_string(value.size()) + " numbers",
          "give 1 or 3");
    constant.width = static_cast<int>(value.size());
    p.initial = value[0];
    for (const double x : value) check_value(material_.name, p, x);
    material_.constants.push_back(value.size() == 1 ? Color<double>(value[0])
                                                    : Color<double>(value[0], value[1], value[2]));
    shader_.constants.push_back(std::move(constant));
  }

  void add_table(const py::dict& row) {
    const auto values = row["values"].cast<Array<float>>();
    require_shape(values, prefix() + "table", {ShaderTable::kSize, 3});
    shader_.tables.push_back(
        {colors_of(values), value_or(row, "low", 0.0f), value_or(row, "high", 1.0f)});
  }

  void add_code(const py::dict& row) {
    Instruction code;
    const auto name = row["op"].cast<std::string>();
    code.op = static_cast<Op>(number_of(kOpNames, name, prefix() + "operation"));
    if (row.contains("mode")) {
      const auto names = mode_names(code.op);
      code.mode = static_cast<std::uint8_t>(
          names.empty() ? row["mode"].cast<int>()
                        : number_of(names, row["mode"].cast<std::string>(), prefix() + name));
    }
    for (const auto& flag : value_or(row, "flags", std::vector<std::string>{}))
      code.flags |= flag_of(flag);
    const auto inputs = row["in"].cast<std::vector<int>>();
    code.first = static_cast<std::uint16_t>(shader_.operands.size());
    code.count = static_cast<std::uint16_t>(inputs.size());
    shader_.operands.insert(shader_.operands.end(), inputs.begin(), inputs.end());
    code.item = value_or(row, "item", -1);
    code.shift = static_cast<std::uint8_t>(value_or(row, "shift", 0));
    code.width = value_or(row, "width", 0.0f);
    shader_.instructions.push_back(code);
  }

  InstructionFlag flag_of(const std::string& name) const {
    for (const auto& [known, flag] : kFlagNames)
      if (name == known) return flag;
    throw NotFound(who_, "shader: there is no flag '" + name + "'");
  }

  void add_closure(const py::dict& row) {
    ShaderClosure closure;
    const auto kind = row["kind"].cast<std::string>();
    closure.kind = static_cast<ClosureKind>(number_of(kClosureNames, kind, prefix() + "closure"));
    const auto inputs = row["inputs"].cast<std::map<std::string, int>>();
    for (const Parameter& p : closure_parameters(closure.kind)) {
      const auto found = inputs.find(std::string(p.name));
      if (found == inputs.end())
        throw Refused(who_, "shader: " + kind + " lacks its " + std::string(p.name),
                      "give it a register");
      closure.inputs.push_back(found->second);
    }
    closure.weight = value_or(row, "weight", -1);
    closure.normal = value_or(row, "normal", -1);
    closure.tangent = value_or(row, "tangent", -1);
    closure.flavour = make_flavour(false, value_or(row, "flavour", std::string("v2")),
                                   value_or(row, "subsurface", std::string("RANDOM_WALK")));
    closure.flavour.distribution = one_of<Flavour::Distribution>(
        "distribution", value_or(row, "distribution", std::string("GGX")),
        {{"GGX", Flavour::Distribution::kGgx},
         {"MULTI_GGX", Flavour::Distribution::kMultiGgx},
         {"BECKMANN", Flavour::Distribution::kBeckmann},
         {"ASHIKHMIN_SHIRLEY", Flavour::Distribution::kAshikhminShirley}});
    closure.flavour.evaluate_unphysical_refraction = !value_or(row, "physical_refraction", false);
    shader_.closures.push_back(std::move(closure));
  }

  Material& material_;
  const py::dict& values_;
  /// Of what is named by one text.
  std::string prefix() const { return who_ + ": shader: "; }
  std::string who_;
  Shader shader_;
};

}  // namespace

Flavour make_flavour(bool multi_ggx, const std::string& version, const std::string& subsurface) {
  Flavour flavour;
  flavour.distribution = multi_ggx ? Flavour::Distribution::kMultiGgx : Flavour::Distribution::kGgx;
  flavour.version = one_of<Flavour::Version>("flavour", version,
                                             {{"v1", Flavour::Version::kV1},
                                              {"v2", Flavour::Version::kV2},
                                              {"v2_of_5", Flavour::Version::kV2}});
  flavour.blender5 = version == "v2_of_5";
  flavour.subsurface =
      one_of<Flavour::Subsurface>("subsurface", subsurface,
                                  {{"RANDOM_WALK", Flavour::Subsurface::kRandomWalk},
                                   {"RANDOM_WALK_SKIN", Flavour::Subsurface::kRandomWalkSkin}});
  return flavour;
}

void set_shader(Material& material, const std::vector<std::shared_ptr<const Texture>>& textures,
                const py::dict& values) {
  ShaderReader(material, values).read(textures);
}

}  // namespace selenite
