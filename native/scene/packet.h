// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

// Rays, hits and surfaces of eight paths side by side, as the eight-lane kernel and Embree's packets
// keep them: number by number, eight lanes each. Plain arrays, so that code for any instruction set
// may pass them on.
namespace selenite {

inline constexpr int kPacket = 8;
template <class T>
struct alignas(32) Packet {
  T lane[kPacket];
  T& operator[](int i) { return lane[i]; }
  const T& operator[](int i) const { return lane[i]; }
};

struct RayPacket {
  Packet<float> origin[3], direction[3], t_min, t_max;
};
struct HitPacket {
  Packet<int> instance;  ///< -1: nothing was hit
  Packet<int> triangle;
  Packet<float> b1, b2, t;
};
}  // namespace selenite
