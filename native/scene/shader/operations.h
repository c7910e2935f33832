// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

namespace selenite {

/// What an instruction of a shader computes. Inputs and modes stand behind each.
enum class Op : std::uint8_t {
  // Arithmetic: a number is the first channel of its register, and goes into all three of the result.
  kMath,            ///< a, b, c; MathMode
  kVectorMath,      ///< a, b, c, number; VectorMode
  kMix,             ///< factor (a channel each), a, b; BlendMode
  kMapRange,        ///< value, from min, from max, to min, to max, steps; RangeMode
  kClamp,           ///< value, min, max; kSorted
  kTable,           ///< x: the table at this number
  kTableChannels,   ///< x: each channel of the table at that channel of x
  kLuminance,       ///< colour to number
  kMean,            ///< vector to number
  kTruncate,        ///< number to whole number
  kChannel,         ///< vector or colour; mode: which channel, as a number
  kCombine,         ///< three numbers
  kConvert,         ///< colour; ConvertMode
  kHueSaturation,   ///< hue, saturation, value, factor, colour
  kBrightContrast,  ///< colour, brightness, contrast
  kGamma,           ///< colour, gamma
  kInvert,          ///< factor, colour
  kBlackbody,       ///< temperature in kelvin
  // Vectors
  kMapping,    ///< vector, location, rotation, scale; MappingMode
  kRotate,     ///< vector, centre, axis, angle, rotation; RotateMode
  kTransform,  ///< vector; TransformMode; `item`: from 3 * from + to of Space
  // Inputs
  kGeometry,     ///< GeometryMode
  kAttribute,    ///< AttributeMode; `item`: its name
  kObject,       ///< ObjectMode
  kPath,         ///< PathMode
  kCamera,       ///< CameraMode
  kFresnel,      ///< IOR, normal
  kLayerWeight,  ///< blend, normal; kFacing
  // Textures
  kImage,       ///< vector; ImageMode; `item`: the texture; box: blend as second input
  kNoise,       ///< vector, w, scale, detail, roughness, lacunarity, offset, gain, distortion
  kWhiteNoise,  ///< vector, w
  kVoronoi,   ///< vector, w, scale, detail, roughness, lacunarity, smoothness, exponent, randomness
  kWave,      ///< vector, scale, distortion, detail, detail scale, detail roughness, phase
  kMagic,     ///< vector, scale, distortion; mode: depth
  kGradient,  ///< vector; GradientMode
  kChecker,   ///< vector, scale: 1 for the first colour, 0 for the second
  kBrick,     ///< vector, scale, mortar size, smooth, bias, width, row height, and BrickMode
  // Normals
  kNormalMap,  ///< strength, colour; NormalMapMode; `item`: the tangents' name
  kBump,       ///< height, the same shifted along x and y, normal, strength, distance
};
inline constexpr std::array kOpNames =
    std::to_array<std::string_view>({"math",         "vector_math",    "mix",
                                     "map_range",    "clamp",          "table",
                                     "table_each",   "luminance",      "mean",
                                     "truncate",     "channel",        "combine",
                                     "convert",      "hue_saturation", "bright_contrast",
                                     "gamma",        "invert",         "blackbody",
                                     "mapping",      "rotate",         "transform",
                                     "geometry",     "attribute",      "object",
                                     "path",         "camera",         "fresnel",
                                     "layer_weight", "image",          "noise",
                                     "white_noise",  "voronoi",        "wave",
                                     "magic",        "gradient",       "checker",
                                     "brick",        "normal_map",     "bump"});
static_assert(kOpNames.size() == static_cast<std::size_t>(Op::kBump) + 1);

/// Bits of Instruction::flags.
enum InstructionFlag : std::uint8_t {
  kClampResult = 1,  ///< to [0, 1]
  kClampFactor = 2,
  kPerChannel = 4,    ///< a map range of vectors
  kSorted = 8,        ///< a clamp whose ends may be exchanged
  kExtrapolate = 16,  ///< a table goes on along its ends
  kStepped = 32,      ///< a table is not interpolated
  kInverted = 64,
  kColored = 128,  ///< a texture's colour instead of its number
};

}  // namespace selenite
