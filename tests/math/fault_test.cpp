// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include "math/problem_list.h"

namespace selenite {
namespace {

TEST(Fault, LineLeavesOutWhatIsEmpty) {
  EXPECT_EQ((Fault{"Photo 'a'", "it is black", "choose another"}.line()),
            "Photo 'a': it is black; choose another");
  EXPECT_EQ((Fault{"", "spp = 0 must lie in [1, 9]", ""}.line()), "spp = 0 must lie in [1, 9]");
}

TEST(Fault, OfAPartNamesTheWholeFirst) {
  const Fault part{"Photo frame", "aspect = -1 is not permitted", "set it to 0"};
  const Fault whole = part.within("Photo 'a'");
  EXPECT_EQ(whole.object, "Photo 'a'");
  EXPECT_EQ(whole.cause, "Photo frame: aspect = -1 is not permitted");
  EXPECT_EQ(whole.cure, "set it to 0");
  EXPECT_EQ(part.within("").object, "Photo frame");
}

TEST(ProblemList, CollectsAllFaultsAndKeepsTheirParts) {
  ProblemList problems;
  problems.add({"A", "it is: odd; very", "mend it"});
  problems.collect([] { throw Refused("B", "one"); });
  problems.collect([] { throw NotFound("", "no 'x'", "names: 'y'"); });
  problems.collect([] {});
  try {
    problems.raise();
    FAIL() << "nothing was raised";
  } catch (const Refused& error) {
    ASSERT_EQ(error.faults().size(), 3U);
    EXPECT_EQ(error.faults()[0].cause, "it is: odd; very");
    EXPECT_EQ(error.faults()[2].cure, "names: 'y'");
    EXPECT_STREQ(error.what(), "A: it is: odd; very; mend it\nB: one\nno 'x'; names: 'y'");
  }
}

TEST(ProblemList, OfNamesAloneIsNotFound) {
  ProblemList problems;
  problems.raise();  // nothing is wrong
  problems.collect([] { throw NotFound("", "no 'x'"); });
  EXPECT_THROW(problems.raise(), NotFound);
}

}  // namespace
}  // namespace selenite
