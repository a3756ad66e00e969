// Predicates for GoogleTest, whose failures print the report:
//
//   EXPECT_TRUE(spring_oracle::is_correct(spring_oracle::check_jacobian(f, jacobian, x)));
//   EXPECT_TRUE(spring_oracle::is_wrong(report, "exactly the negative"));
#ifndef SPRING_ORACLE_GTEST_HPP
#define SPRING_ORACLE_GTEST_HPP

#include <gtest/gtest.h>

#include "spring_oracle.hpp"

namespace spring_oracle {

/// Whether all of a report, or of one of a force, is correct.
template <class R>
testing::AssertionResult is_correct(const R& report) {
    return report.correct() ? testing::AssertionSuccess() : testing::AssertionFailure() << report;
}

/// Whether the error looks like this; without a text, whether anything is wrong.
template <class R>
testing::AssertionResult is_wrong(const R& report, const std::string& like = "") {
    const bool holds = report.wrong() && report.looks().find(like) != std::string::npos;
    return (holds ? testing::AssertionSuccess() : testing::AssertionFailure()) << report;
}

}  // namespace spring_oracle
#endif
