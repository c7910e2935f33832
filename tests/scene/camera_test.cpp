// SPDX-License-Identifier: GPL-3.0-or-later
#include "scene/camera.h"

#include <gtest/gtest.h>

#include <functional>
#include <limits>

#include "math/error.h"
#include "scene/small_scenes.h"

namespace selenite {
namespace {

Camera default_camera() {
  Camera camera;
  camera.name = "Camera";
  return camera;
}

struct View {
  SensorFit fit;
  int width, height;
  double shift_x, shift_y, aspect_x, aspect_y;
  bool orthographic;
};
void PrintTo(const View& v, std::ostream* out) {
  *out << "fit " << static_cast<int>(v.fit) << " " << v.width << "x" << v.height << " shift "
       << v.shift_x << "," << v.shift_y << " aspect " << v.aspect_x << ":" << v.aspect_y
       << (v.orthographic ? " orthographic" : "");
}

std::vector<View> all_views() {
  std::vector<View> views;
  for (const SensorFit fit : {SensorFit::kAuto, SensorFit::kHorizontal, SensorFit::kVertical})
    for (const auto& [w, h] : {std::pair{640, 360}, {360, 640}, {500, 500}, {1, 7}})
      for (const auto& [sx, sy] : {std::pair{0.0, 0.0}, {0.3, -0.2}})
        for (const auto& [ax, ay] : {std::pair{1.0, 1.0}, {2.0, 1.0}, {1.0, 1.5}})
          for (const bool orthographic : {false, true})
            views.push_back({fit, w, h, sx, sy, ax, ay, orthographic});
  return views;
}

class CameraView : public testing::TestWithParam<View> {
 protected:
  Camera camera() const {
    const View& v = GetParam();
    Camera c = default_camera();
    c.sensor_fit = v.fit;
    c.shift_x = v.shift_x;
    c.shift_y = v.shift_y;
    c.pixel_aspect_x = v.aspect_x;
    c.pixel_aspect_y = v.aspect_y;
    c.orthographic = v.orthographic;
    c.lens_mm = 35;
    c.to_world = looking_at({3, -4, 2}, {0.5, 0.2, -0.1});
    c.check();
    return c;
  }
};

TEST_P(CameraView, ProjectionFollowsTheFormula) {
  // docs/method/rendering.md, "Camera", written out anew: D is the fitted dimension.
  const View& v = GetParam();
  const Camera c = camera();
  const PixelCamera pixels(c, v.width, v.height);
  const double wa = v.width * v.aspect_x, ha = v.height * v.aspect_y;
  double d = 0, sensor = c.sensor_width_mm;
  switch (v.fit) {
    case SensorFit::kHorizontal:
      d = wa;
      break;
    case SensorFit::kVertical:
      d = ha;
      sensor = c.sensor_height_mm;
      break;
    case SensorFit::kAuto:
      d = std::max(wa, ha);
  }
  for (const Vec3d& local : {Vec3d{0, 0, -1}, {0.3, 0.1, -2}, {-1, 0.7, -5}, {20, -30, -100}}) {
    const double f = v.orthographic ? d / c.ortho_scale : c.lens_mm / sensor * d / -local.z;
    const double px = (wa / 2 + f * local.x - v.shift_x * d) / v.aspect_x;
    const double py = (ha / 2 - (f * local.y - v.shift_y * d)) / v.aspect_y;
    const Vec2<double> got = pixels.project(c.to_world.point(local));
    EXPECT_NEAR(got.x, px, 1e-9 * (1 + std::abs(px)));
    EXPECT_NEAR(got.y, py, 1e-9 * (1 + std::abs(py)));
  }
}

TEST_P(CameraView, RaysGoThroughThePixelTheyStartFrom) {
  const View& v = GetParam();
  const Camera c = camera();
  const PixelCamera pixels(c, v.width, v.height);
  for (const float fx : {0.0f, 0.37f, 1.0f})
    for (const float fy : {0.0f, 0.81f, 1.0f}) {
      const float px = fx * v.width, py = fy * v.height;
      const Ray ray = pixels.ray(px, py);
      EXPECT_NEAR(dot(ray.direction, ray.direction), 1, 1e-6);
      for (const double t : {1.0, 30.0}) {
        const Vec2<double> back = pixels.project(Vec3d(ray.origin) + Vec3d(ray.direction) * t);
        EXPECT_NEAR(back.x, px, 1e-3 + 1e-6 * v.width);
        EXPECT_NEAR(back.y, py, 1e-3 + 1e-6 * v.height);
      }
    }
}

TEST_P(CameraView, ClipPlanesArePerpendicularToTheAxis) {
  const View& v = GetParam();
  Camera c = camera();
  c.clip_start = 0.25;
  c.clip_end = 40;
  const PixelCamera pixels(c, v.width, v.height);
  const Vec3d forward = -c.to_world.column(2);
  for (const float f : {0.0f, 0.5f, 1.0f}) {
    const Ray ray = pixels.ray(f * v.width, f * v.height);
    const auto depth = [&](double t) {
      return dot(Vec3d(ray.origin) + Vec3d(ray.direction) * t - c.to_world.translation(), forward);
    };
    EXPECT_NEAR(depth(ray.t_min), 0.25, 1e-5);
    EXPECT_NEAR(depth(ray.t_max), 40, 1e-4);
  }
}

TEST_P(CameraView, RoundedPicturesShowTheSameFrame) {
  const View& v = GetParam();
  const Camera c = camera();
  const double aspect = static_cast<double>(v.width) / v.height;
  const PixelCamera whole(c, v.width, v.height);
  for (const auto& [w, h] : {std::pair{21, 16}, {1, 1}, {7, 90}}) {
    const PixelCamera rounded(c, w, h, {aspect, 0, 0});
    for (const float fx : {0.0f, 0.37f, 1.0f})
      for (const float fy : {0.0f, 0.81f, 1.0f}) {
        const Ray expected = whole.ray(fx * v.width, fy * v.height),
                  got = rounded.ray(fx * w, fy * h);
        EXPECT_LT(length(got.direction - expected.direction), 1e-5);
        EXPECT_LT(length(got.origin - expected.origin), 1e-4);
        const Vec2<double> back = rounded.project(Vec3d(got.origin) + Vec3d(got.direction) * 3.0);
        EXPECT_NEAR(back.x, fx * w, 1e-3);
        EXPECT_NEAR(back.y, fy * h, 1e-3);
      }
  }
}

TEST_P(CameraView, CropsShowTheirPartOfTheFrame) {
  const View& v = GetParam();
  const Camera c = camera();
  const double aspect = static_cast<double>(v.width) / v.height;
  const PixelCamera whole(c, v.width, v.height);
  const FrameWindow windows[] = {{0.25, 0.1, 0.75, 0.4}, {0, 0.5, 0.125, 1}, {0.9, 0, 1, 1}};
  for (const FrameWindow& window : windows)
    for (const auto& [w, h] : {std::pair{21, 16}, {7, 90}}) {
      const PixelCamera crop(c, w, h, {aspect, 0, 0, window});
      for (const double fx : {0.0, 0.37, 1.0})
        for (const double fy : {0.0, 0.81, 1.0}) {
          const double x = window.left + fx * (window.right - window.left);
          const double y = window.top + fy * (window.bottom - window.top);
          const Ray expected =
              whole.ray(static_cast<float>(x * v.width), static_cast<float>(y * v.height));
          const Ray got = crop.ray(static_cast<float>(fx * w), static_cast<float>(fy * h));
          EXPECT_LT(length(got.direction - expected.direction), 1e-5);
          EXPECT_LT(length(got.origin - expected.origin), 1e-4);
          const Vec2<double> back = crop.project(Vec3d(got.origin) + Vec3d(got.direction) * 3.0);
          EXPECT_NEAR(back.x, fx * w, 2e-3);
          EXPECT_NEAR(back.y, fy * h, 2e-3);
        }
    }
}
INSTANTIATE_TEST_SUITE_P(All, CameraView, testing::ValuesIn(all_views()));

TEST(Camera, CentreAndCornersOfTheDefaultCamera) {
  // 50 mm, 36 mm sensor: at depth 50 the picture is 36 wide and, at 3:2, 24 high.
  Camera c = default_camera();
  c.check();
  const PixelCamera pixels(c, 300, 200);
  const auto at = [&](double x, double y) { return pixels.project({x, y, -50}); };
  EXPECT_NEAR(at(0, 0).x, 150, 1e-9);
  EXPECT_NEAR(at(0, 0).y, 100, 1e-9);
  EXPECT_NEAR(at(-18, 12).x, 0, 1e-9);  // top left
  EXPECT_NEAR(at(-18, 12).y, 0, 1e-9);
  EXPECT_NEAR(at(18, -12).x, 300, 1e-9);
  EXPECT_NEAR(at(18, -12).y, 200, 1e-9);
}

TEST(Camera, ScaleOfItsObjectIsIgnored) {
  Camera plain = default_camera(), scaled = default_camera();
  plain.to_world = scaled.to_world = looking_at({1, 2, 3}, {0, 0, 0});
  const double sizes[3] = {3, 0.01, 250};
  for (int j = 0; j < 3; ++j)
    for (int i = 0; i < 3; ++i) scaled.to_world.m[i][j] *= sizes[j];
  plain.check();
  scaled.check();
  const PixelCamera a(plain, 64, 48), b(scaled, 64, 48);
  for (const float p : {0.0f, 20.5f, 48.0f}) {
    const Vec3f da = a.ray(p, p).direction, db = b.ray(p, p).direction;
    EXPECT_NEAR(length(da - db), 0, 1e-6);
  }
}

TEST(Camera, PointsBehindItAreNowhere) {
  Camera c = default_camera();
  const PixelCamera pixels(c, 10, 10);
  EXPECT_TRUE(std::isnan(pixels.project({0, 0, 1}).x));
  EXPECT_TRUE(std::isnan(pixels.project({0, 0, 0}).y));
  c.orthographic = true;
  const PixelCamera flat(c, 10, 10);
  EXPECT_EQ(flat.project({0, 0, 1}).x, 5);
}

struct BadCamera {
  const char* words;
  std::function<void(Camera&)> spoil;
};
void PrintTo(const BadCamera& b, std::ostream* out) { *out << b.words; }
class CameraCheck : public testing::TestWithParam<BadCamera> {};

TEST_P(CameraCheck, RefusesBadValuesNamingCameraAndValue) {
  Camera c = default_camera();
  c.name = "Left eye";
  EXPECT_NO_THROW(c.check());
  GetParam().spoil(c);
  try {
    c.check();
    FAIL() << "accepted";
  } catch (const InvalidArgument& error) {
    const std::string text = error.what();
    EXPECT_NE(text.find("'Left eye'"), std::string::npos) << text;
    EXPECT_NE(text.find(GetParam().words), std::string::npos) << text;
  }
}
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInf = std::numeric_limits<double>::infinity();
INSTANTIATE_TEST_SUITE_P(
    Bad, CameraCheck,
    testing::Values(BadCamera{"focal length", [](Camera& c) { c.lens_mm = 0; }},
                    BadCamera{"focal length", [](Camera& c) { c.lens_mm = kNan; }},
                    BadCamera{"focal length", [](Camera& c) { c.lens_mm = kInf; }},
                    BadCamera{"sensor width", [](Camera& c) { c.sensor_width_mm = -1; }},
                    BadCamera{"sensor height", [](Camera& c) { c.sensor_height_mm = kNan; }},
                    BadCamera{"orthographic scale",
                              [](Camera& c) { c.orthographic = true, c.ortho_scale = 0; }},
                    BadCamera{"shift x", [](Camera& c) { c.shift_x = kInf; }},
                    BadCamera{"shift y", [](Camera& c) { c.shift_y = kNan; }},
                    BadCamera{"clip start", [](Camera& c) { c.clip_start = 0; }},
                    BadCamera{"clip end", [](Camera& c) { c.clip_end = c.clip_start; }},
                    BadCamera{"clip end", [](Camera& c) { c.clip_end = kNan; }},
                    BadCamera{"pixel aspect x", [](Camera& c) { c.pixel_aspect_x = 0; }},
                    BadCamera{"pixel aspect y", [](Camera& c) { c.pixel_aspect_y = kInf; }},
                    BadCamera{"scale", [](Camera& c) { c.to_world.m = {}; }},
                    BadCamera{"location", [](Camera& c) { c.to_world.m[1][3] = kNan; }}));

}  // namespace
}  // namespace selenite
