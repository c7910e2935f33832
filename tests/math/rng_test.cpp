// SPDX-License-Identifier: GPL-3.0-or-later
#include "math/rng.h"

#include <gtest/gtest.h>

#include <functional>
#include <set>

#include "math/statistics.h"

namespace selenite {
namespace {

struct Key {
  std::uint64_t seed = 7;
  std::uint32_t pixel = 11, sample = 3, bounce = 2, dimension = 5;

  float number() const {
    Random random(seed, pixel, sample);
    random.start_bounce(bounce);
    return random.uniform(dimension);
  }
};

/// The parts of the key, one of which runs while the others stand still.
struct Part {
  const char* name;
  std::function<void(Key&, std::uint32_t)> set;
};
void PrintTo(const Part& p, std::ostream* out) { *out << p.name; }

const Part kParts[] = {
    {"seed", [](Key& k, std::uint32_t i) { k.seed = i; }},
    {"pixel", [](Key& k, std::uint32_t i) { k.pixel = i; }},
    {"sample", [](Key& k, std::uint32_t i) { k.sample = i; }},
    {"bounce", [](Key& k, std::uint32_t i) { k.bounce = i; }},
    {"dimension", [](Key& k, std::uint32_t i) { k.dimension = i; }},
};
constexpr std::uint32_t kCount = 40000;  // below 2^16, the room of a bounce's dimensions

std::vector<double> stream(const Part& part, Key key, std::uint32_t first = 0) {
  std::vector<double> numbers;
  for (std::uint32_t i = first; i < first + kCount; ++i) {
    part.set(key, i);
    numbers.push_back(key.number());
  }
  return numbers;
}

TEST(Random, EqualKeysGiveEqualNumbersWhateverWasDrawnBefore) {
  Random fresh(5, 6, 7), used(5, 6, 7);
  for (int i = 0; i < 100; ++i) used.uniform(static_cast<std::uint32_t>(i));
  used.start_bounce(9);
  used.start_bounce(4);
  fresh.start_bounce(4);
  EXPECT_EQ(fresh.uniform(3), used.uniform(3));
  EXPECT_EQ(Key{}.number(), Key{}.number());
}

class RandomPart : public testing::TestWithParam<Part> {};

TEST_P(RandomPart, NumbersAreUniform) {
  // 256 cells, chi-square; false alarms 1 in 32 000.
  const std::vector<double> numbers = stream(GetParam(), Key{});
  std::vector<double> counts(256, 0), expected(256, kCount / 256.0);
  for (const double x : numbers) {
    ASSERT_GE(x, 0);
    ASSERT_LT(x, 1);
    ++counts[static_cast<int>(x * 256)];
  }
  EXPECT_LT(std::abs(chi_square_z(counts, expected)), 4);
}

TEST_P(RandomPart, NeighbouringNumbersAreIndependent) {
  // Pairs (x_i, x_{i + lag}) on a 16 x 16 grid, and their correlation; false alarms 1 in 16 000.
  const std::vector<double> numbers = stream(GetParam(), Key{});
  for (const std::size_t lag : {1, 2, 3, 64, 256}) {
    const std::vector<double> a(numbers.begin(), numbers.end() - static_cast<long>(lag)),
        b(numbers.begin() + static_cast<long>(lag), numbers.end());
    EXPECT_LT(std::abs(correlation_z(a, b)), 4) << "lag " << lag;
    std::vector<double> counts(256, 0), expected(256, static_cast<double>(a.size()) / 256);
    for (std::size_t i = 0; i < a.size(); ++i)
      ++counts[static_cast<int>(a[i] * 16) * 16 + static_cast<int>(b[i] * 16)];
    EXPECT_LT(std::abs(chi_square_z(counts, expected)), 4) << "lag " << lag;
  }
}

TEST_P(RandomPart, EveryOtherPartGivesAnUnrelatedStream) {
  const std::vector<double> base = stream(GetParam(), Key{});
  for (const Part& other : kParts) {
    if (other.name == GetParam().name) continue;
    for (const std::uint32_t value : {0u, 1u, 12u, 60000u}) {
      Key key;
      other.set(key, value);
      const std::vector<double> numbers = stream(GetParam(), key);
      if (numbers == base) continue;  // the very key of `base`
      EXPECT_LT(std::abs(correlation_z(base, numbers)), 4.5) << other.name << " " << value;
    }
  }
}
INSTANTIATE_TEST_SUITE_P(Keys, RandomPart, testing::ValuesIn(kParts),
                         [](const auto& info) { return info.param.name; });

TEST(Random, SwappedPartsOfTheKeyAreDifferentKeys) {
  // A key that is a sum would give pixel 3, sample 4 the numbers of pixel 4, sample 3.
  std::set<float> numbers;
  int count = 0;
  for (std::uint64_t seed = 0; seed < 5; ++seed)
    for (std::uint32_t pixel = 0; pixel < 5; ++pixel)
      for (std::uint32_t sample = 0; sample < 5; ++sample)
        for (std::uint32_t bounce = 0; bounce < 5; ++bounce)
          for (std::uint32_t dimension = 0; dimension < 5; ++dimension) {
            numbers.insert(Key{seed, pixel, sample, bounce, dimension}.number());
            ++count;
          }
  // Birthdays among 2^24 numbers: 0.3 pairs expected; 5 or more once in 3000.
  EXPECT_GE(static_cast<int>(numbers.size()), count - 4);
}

TEST(Random, LargeSeedsAndPixelsCount) {
  const float base = Key{}.number();
  EXPECT_NE((Key{.seed = 7 + (1ull << 63)}).number(), base);
  EXPECT_NE((Key{.seed = 7 + (1ull << 32)}).number(), base);
  EXPECT_NE((Key{.pixel = 11 + (1u << 31)}).number(), base);
  EXPECT_NE((Key{.sample = 3 + (1u << 31)}).number(), base);
  EXPECT_NE((Key{.bounce = 4096}).number(), (Key{.bounce = 4097}).number());
}

TEST(Random, ABranchIsAStreamOfItsOwn) {
  constexpr std::uint32_t kNumbers = 20000;
  Random random(7, 11, 3);
  random.start_bounce(2);
  const auto numbers = [](const Random& from) {
    std::vector<double> found;
    for (std::uint32_t i = 0; i < kNumbers; ++i) found.push_back(from.uniform(i));
    return found;
  };
  const Random branch = random.branch(5);
  const std::vector<double> first = numbers(branch);
  EXPECT_EQ(first, numbers(random.branch(5)));
  Random next = random;
  next.start_bounce(3);
  // Four comparisons beyond 4.5: 1 false alarm in 40 000.
  for (const Random& other : {random, random.branch(6), next.branch(5), branch.branch(0)})
    EXPECT_LT(std::abs(correlation_z(first, numbers(other))), 4.5);
  Tally mean;
  for (const double x : first) mean.add(x);
  EXPECT_LT(std::abs(mean.estimate().z(0.5)), 4);
}

}  // namespace
}  // namespace selenite
