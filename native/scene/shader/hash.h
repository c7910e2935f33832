// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <bit>
#include <cstdint>

// Hashes of whole numbers and of the bits of floats, as Cycles makes its textures of them.
// Sources: Jenkins 2006, lookup3 (public domain); Jarzynski and Olano 2020, "Hash Functions for GPU
// Rendering".
namespace selenite::shading {

/// Up to four words.
template <std::size_t N>
constexpr std::uint32_t hash_of(const std::array<std::uint32_t, N>& words) {
  static_assert(N >= 1 && N <= 4);
  using std::rotl;
  std::uint32_t a = 0xdeadbeefu + (static_cast<std::uint32_t>(N) << 2) + 13u, b = a, c = a;
  a += words[0];
  if constexpr (N > 1) b += words[1];
  if constexpr (N > 2) c += words[2];
  if constexpr (N > 3) {
    a -= c, a ^= rotl(c, 4), c += b;
    b -= a, b ^= rotl(a, 6), a += c;
    c -= b, c ^= rotl(b, 8), b += a;
    a -= c, a ^= rotl(c, 16), c += b;
    b -= a, b ^= rotl(a, 19), a += c;
    c -= b, c ^= rotl(b, 4), b += a;
    a += words[3];
  }
  c ^= b, c -= rotl(b, 14);
  a ^= c, a -= rotl(c, 11);
  b ^= a, b -= rotl(a, 25);
  c ^= b, c -= rotl(b, 16);
  a ^= c, a -= rotl(c, 4);
  b ^= a, b -= rotl(a, 14);
  c ^= b, c -= rotl(b, 24);
  return c;
}

/// Uniform in [0, 1], of the bits of floats.
template <std::size_t N>
float random_of(const std::array<float, N>& key) {
  std::array<std::uint32_t, N> words;
  for (std::size_t i = 0; i < N; ++i) words[i] = std::bit_cast<std::uint32_t>(key[i]);
  return static_cast<float>(hash_of(words)) / static_cast<float>(0xFFFFFFFFu);
}
/// The same of a key with another number behind it; of four numbers there is no fifth.
template <std::size_t N>
float random_of(const std::array<float, N>& key, float more) {
  std::array<float, N + 1> longer;
  for (std::size_t i = 0; i < N; ++i) longer[i] = key[i];
  longer[N] = more;
  return random_of(longer);
}

/// Three numbers of one key.
template <std::size_t N>
std::array<float, 3> random_color(const std::array<float, N>& k) {
  if constexpr (N == 4)
    return {random_of(k), random_of(std::array{k[2], k[0], k[3], k[1]}),
            random_of(std::array{k[3], k[2], k[1], k[0]})};
  else
    return {random_of(k), random_of(k, 1.0f), random_of(k, 2.0f)};
}

/// As many numbers as the key has.
template <std::size_t N>
std::array<float, N> random_point(const std::array<float, N>& k) {
  if constexpr (N == 1)
    return {random_of(k)};
  else if constexpr (N == 2)
    return {random_of(k), random_of(k, 1.0f)};
  else if constexpr (N == 3)
    return random_color(k);
  else
    return {random_of(k), random_of(std::array{k[3], k[0], k[1], k[2]}),
            random_of(std::array{k[2], k[3], k[0], k[1]}),
            random_of(std::array{k[1], k[2], k[3], k[0]})};
}

/// As many numbers in [0, 1] of a key of whole numbers, by a linear congruence whose words are mixed.
template <std::size_t N>
std::array<float, N> random_cell(const std::array<std::int32_t, N>& key) {
  static_assert(N >= 2 && N <= 4);
  std::array<std::uint32_t, N> v;
  for (std::size_t i = 0; i < N; ++i)
    v[i] = static_cast<std::uint32_t>(key[i]) * 1664525u + 1013904223u;
  const auto mix = [&v] {
    if constexpr (N == 2) {
      v[0] += v[1] * 1664525u;
      v[1] += v[0] * 1664525u;
    } else if constexpr (N == 3) {
      v[0] += v[1] * v[2];
      v[1] += v[2] * v[0];
      v[2] += v[0] * v[1];
    } else {
      v[0] += v[1] * v[3];
      v[1] += v[2] * v[0];
      v[2] += v[0] * v[1];
      v[3] += v[1] * v[2];
    }
  };
  mix();
  for (std::uint32_t& x : v) x ^= static_cast<std::uint32_t>(static_cast<std::int32_t>(x) >> 16);
  mix();
  std::array<float, N> random;
  constexpr std::uint32_t kMost = 0x7FFFFFFFu;
  for (std::size_t i = 0; i < N; ++i)
    random[i] = static_cast<float>(v[i] & kMost) * (1.0f / static_cast<float>(kMost));
  return random;
}

}  // namespace selenite::shading
