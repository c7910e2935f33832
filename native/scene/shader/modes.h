// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string_view>

#include "scene/shader/operations.h"

// What an instruction does in particular. Where Blender has a name for it, that is its name.
namespace selenite {

enum class MathMode : std::uint8_t {
  kAdd,
  kSubtract,
  kMultiply,
  kDivide,
  kMultiplyAdd,
  kPower,
  kLogarithm,
  kSqrt,
  kInverseSqrt,
  kAbsolute,
  kExponent,
  kMinimum,
  kMaximum,
  kLessThan,
  kGreaterThan,
  kSign,
  kCompare,
  kSmoothMin,
  kSmoothMax,
  kRound,
  kFloor,
  kCeil,
  kTrunc,
  kFract,
  kModulo,
  kFlooredModulo,
  kWrap,
  kSnap,
  kPingPong,
  kSine,
  kCosine,
  kTangent,
  kArcSine,
  kArcCosine,
  kArcTangent,
  kArcTan2,
  kSinh,
  kCosh,
  kTanh,
  kRadians,
  kDegrees,
};
inline constexpr auto kMathNames = std::to_array<std::string_view>(
    {"ADD",        "SUBTRACT",       "MULTIPLY",     "DIVIDE",    "MULTIPLY_ADD", "POWER",
     "LOGARITHM",  "SQRT",           "INVERSE_SQRT", "ABSOLUTE",  "EXPONENT",     "MINIMUM",
     "MAXIMUM",    "LESS_THAN",      "GREATER_THAN", "SIGN",      "COMPARE",      "SMOOTH_MIN",
     "SMOOTH_MAX", "ROUND",          "FLOOR",        "CEIL",      "TRUNC",        "FRACT",
     "MODULO",     "FLOORED_MODULO", "WRAP",         "SNAP",      "PINGPONG",     "SINE",
     "COSINE",     "TANGENT",        "ARCSINE",      "ARCCOSINE", "ARCTANGENT",   "ARCTAN2",
     "SINH",       "COSH",           "TANH",         "RADIANS",   "DEGREES"});
static_assert(kMathNames.size() == static_cast<std::size_t>(MathMode::kDegrees) + 1);

enum class VectorMode : std::uint8_t {
  kAdd,
  kSubtract,
  kMultiply,
  kDivide,
  kMultiplyAdd,
  kCross,
  kProject,
  kReflect,
  kRefract,
  kFaceForward,
  kDot,
  kDistance,
  kLength,
  kScale,
  kNormalize,
  kAbsolute,
  kPower,
  kSign,
  kMinimum,
  kMaximum,
  kFloor,
  kCeil,
  kFraction,
  kModulo,
  kWrap,
  kSnap,
  kSine,
  kCosine,
  kTangent,
};
inline constexpr auto kVectorNames = std::to_array<std::string_view>(
    {"ADD",     "SUBTRACT", "MULTIPLY",  "DIVIDE",      "MULTIPLY_ADD", "CROSS_PRODUCT",
     "PROJECT", "REFLECT",  "REFRACT",   "FACEFORWARD", "DOT_PRODUCT",  "DISTANCE",
     "LENGTH",  "SCALE",    "NORMALIZE", "ABSOLUTE",    "POWER",        "SIGN",
     "MINIMUM", "MAXIMUM",  "FLOOR",     "CEIL",        "FRACTION",     "MODULO",
     "WRAP",    "SNAP",     "SINE",      "COSINE",      "TANGENT"});
static_assert(kVectorNames.size() == static_cast<std::size_t>(VectorMode::kTangent) + 1);

enum class BlendMode : std::uint8_t {
  kMix,
  kDarken,
  kMultiply,
  kBurn,
  kLighten,
  kScreen,
  kDodge,
  kAdd,
  kOverlay,
  kSoftLight,
  kLinearLight,
  kDifference,
  kExclusion,
  kSubtract,
  kDivide,
  kHue,
  kSaturation,
  kColor,
  kValue,
};
inline constexpr auto kBlendNames = std::to_array<std::string_view>(
    {"MIX", "DARKEN", "MULTIPLY", "BURN", "LIGHTEN", "SCREEN", "DODGE", "ADD", "OVERLAY",
     "SOFT_LIGHT", "LINEAR_LIGHT", "DIFFERENCE", "EXCLUSION", "SUBTRACT", "DIVIDE", "HUE",
     "SATURATION", "COLOR", "VALUE"});
static_assert(kBlendNames.size() == static_cast<std::size_t>(BlendMode::kValue) + 1);

enum class RangeMode : std::uint8_t { kLinear, kStepped, kSmooth, kSmoother };
inline constexpr auto kRangeNames =
    std::to_array<std::string_view>({"LINEAR", "STEPPED", "SMOOTHSTEP", "SMOOTHERSTEP"});

enum class ConvertMode : std::uint8_t { kToHsv, kFromHsv, kToHsl, kFromHsl };
inline constexpr auto kConvertNames =
    std::to_array<std::string_view>({"to_hsv", "from_hsv", "to_hsl", "from_hsl"});

enum class MappingMode : std::uint8_t { kPoint, kTexture, kVector, kNormal };
inline constexpr auto kMappingNames =
    std::to_array<std::string_view>({"POINT", "TEXTURE", "VECTOR", "NORMAL"});

enum class RotateMode : std::uint8_t { kAxis, kX, kY, kZ, kEuler };
inline constexpr auto kRotateNames =
    std::to_array<std::string_view>({"AXIS_ANGLE", "X_AXIS", "Y_AXIS", "Z_AXIS", "EULER_XYZ"});

enum class TransformMode : std::uint8_t { kPoint, kVector, kNormal };
inline constexpr auto kTransformNames =
    std::to_array<std::string_view>({"POINT", "VECTOR", "NORMAL"});
/// Of a transform, in `item`: 3 * from + to.
enum class Space : std::uint8_t { kWorld, kObject, kCamera };

/// Normals are on the side of the viewer.
enum class GeometryMode : std::uint8_t {
  kPosition,
  kNormal,
  kTrueNormal,
  kIncoming,
  kParametric,
  kBackfacing,
  kObjectPosition,  ///< position in the object's own space
  kObjectNormal,    ///< Normal of Texture Coordinate
  kReflection,      ///< of the viewer's direction
};
inline constexpr auto kGeometryNames = std::to_array<std::string_view>(
    {"position", "normal", "true_normal", "incoming", "parametric", "backfacing", "object_position",
     "object_normal", "reflection"});
static_assert(kGeometryNames.size() == static_cast<std::size_t>(GeometryMode::kReflection) + 1);

/// UV map, colour attribute, or what was made for shaders (Mesh::vectors).
enum class AttributeMode : std::uint8_t { kUv, kColor, kVector };
inline constexpr auto kAttributeNames = std::to_array<std::string_view>({"uv", "color", "vector"});

enum class ObjectMode : std::uint8_t { kLocation, kColor, kAlpha, kIndex, kRandom };
inline constexpr auto kObjectNames =
    std::to_array<std::string_view>({"location", "color", "alpha", "index", "random"});

/// Outputs of Light Path.
enum class PathMode : std::uint8_t {
  kCameraRay,
  kShadowRay,
  kDiffuseRay,
  kGlossyRay,
  kSingularRay,
  kReflectionRay,
  kTransmissionRay,
  kVolumeRay,
  kRayLength,
  kRayDepth,
  kDiffuseDepth,
  kGlossyDepth,
  kTransparentDepth,
  kTransmissionDepth,
};
inline constexpr auto kPathNames = std::to_array<std::string_view>(
    {"Is Camera Ray", "Is Shadow Ray", "Is Diffuse Ray", "Is Glossy Ray", "Is Singular Ray",
     "Is Reflection Ray", "Is Transmission Ray", "Is Volume Scatter Ray", "Ray Length", "Ray Depth",
     "Diffuse Depth", "Glossy Depth", "Transparent Depth", "Transmission Depth"});
static_assert(kPathNames.size() == static_cast<std::size_t>(PathMode::kTransmissionDepth) + 1);

enum class CameraMode : std::uint8_t { kViewVector, kDepth, kDistance, kPosition };
inline constexpr auto kCameraNames =
    std::to_array<std::string_view>({"vector", "depth", "distance", "position"});

enum class LayerMode : std::uint8_t { kFresnel, kFacing };
inline constexpr auto kLayerNames = std::to_array<std::string_view>({"Fresnel", "Facing"});

enum class ImageMode : std::uint8_t { kFlat, kBox, kSphere, kTube };
inline constexpr auto kImageNames =
    std::to_array<std::string_view>({"FLAT", "BOX", "SPHERE", "TUBE"});

/// Dimensions - 1 in the upper bits of an instruction's mode, the type in the lower three.
enum class NoiseMode : std::uint8_t { kFbm, kMultifractal, kHetero, kHybrid, kRidged };
enum class VoronoiMode : std::uint8_t { kF1, kF2, kSmoothF1, kEdge, kSphereRadius };
/// In the two bits above the dimensions.
enum class VoronoiMetric : std::uint8_t { kEuclidean, kManhattan, kChebychev, kMinkowski };
/// Which of a Voronoi Texture's outputs, in `item`.
enum class VoronoiOutput : std::uint8_t { kDistance, kColor, kPosition, kW };
constexpr int texture_type(std::uint8_t mode) { return mode & 7; }
constexpr int texture_dimensions(std::uint8_t mode) { return 1 + ((mode >> 3) & 3); }
constexpr int texture_metric(std::uint8_t mode) { return (mode >> 5) & 3; }
/// Whether cells are those of Blender 5.
constexpr bool texture_of_5(std::uint8_t mode) { return mode & 0x80; }
inline constexpr std::uint8_t kNormalized = kPerChannel;

/// Of a Wave Texture: direction (x, y, z, and diagonal or spherical), then rings, then the profile.
constexpr int wave_direction(std::uint8_t mode) { return mode & 3; }
constexpr bool wave_rings(std::uint8_t mode) { return (mode & 4) != 0; }
enum class WaveProfile : std::uint8_t { kSine, kSaw, kTriangle };
constexpr WaveProfile wave_profile(std::uint8_t mode) {
  return static_cast<WaveProfile>((mode >> 3) & 3);
}
/// What a Brick Texture gives: the share of mortar, or how much of the second colour a brick has.
enum class BrickMode : std::uint8_t { kMortar, kTint };

enum class GradientMode : std::uint8_t {
  kLinear,
  kQuadratic,
  kEasing,
  kDiagonal,
  kSphere,
  kQuadraticSphere,
  kRadial,
};
inline constexpr auto kGradientNames = std::to_array<std::string_view>(
    {"LINEAR", "QUADRATIC", "EASING", "DIAGONAL", "SPHERICAL", "QUADRATIC_SPHERE", "RADIAL"});

enum class NormalMapMode : std::uint8_t { kTangent, kObject, kWorld };
inline constexpr auto kNormalMapNames =
    std::to_array<std::string_view>({"TANGENT", "OBJECT", "WORLD"});

/// The names of an operation's modes by number; empty: its mode is a number.
constexpr std::span<const std::string_view> mode_names(Op op) {
  switch (op) {
    case Op::kMath:
      return kMathNames;
    case Op::kVectorMath:
      return kVectorNames;
    case Op::kMix:
      return kBlendNames;
    case Op::kMapRange:
      return kRangeNames;
    case Op::kConvert:
      return kConvertNames;
    case Op::kMapping:
      return kMappingNames;
    case Op::kRotate:
      return kRotateNames;
    case Op::kTransform:
      return kTransformNames;
    case Op::kGeometry:
      return kGeometryNames;
    case Op::kAttribute:
      return kAttributeNames;
    case Op::kObject:
      return kObjectNames;
    case Op::kPath:
      return kPathNames;
    case Op::kCamera:
      return kCameraNames;
    case Op::kLayerWeight:
      return kLayerNames;
    case Op::kImage:
      return kImageNames;
    case Op::kGradient:
      return kGradientNames;
    case Op::kNormalMap:
      return kNormalMapNames;
    default:
      return {};
  }
}

}  // namespace selenite
