// Matchers for Catch2, versions 2 and 3:
//
//   REQUIRE_THAT(spring_oracle::check_jacobian(f, jacobian, x), spring_oracle::IsCorrect());
//   CHECK_THAT(report, spring_oracle::IsWrong("exactly the negative"));
#ifndef SPRING_ORACLE_CATCH2_HPP
#define SPRING_ORACLE_CATCH2_HPP

#if __has_include(<catch2/matchers/catch_matchers_templated.hpp>)
#include <catch2/catch_tostring.hpp>
#include <catch2/matchers/catch_matchers_templated.hpp>
namespace spring_oracle::detail { using MatcherBase = Catch::Matchers::MatcherGenericBase; }
#else
#include <catch2/catch.hpp>
namespace spring_oracle::detail { using MatcherBase = Catch::Matchers::Impl::MatcherUntypedBase; }
#endif

#include "spring_oracle.hpp"

namespace spring_oracle {

/// Matches a report, or one of a force, of which all is correct. A report that does not match is printed.
struct IsCorrect : detail::MatcherBase {
    template <class R>
    bool match(const R& report) const { return report.correct(); }
    std::string describe() const override { return "is correct"; }
};

/// Matches a report whose error looks like this; without a text, any that is wrong.
struct IsWrong : detail::MatcherBase {
    explicit IsWrong(std::string like = "") : like(std::move(like)) {}
    template <class R>
    bool match(const R& report) const { return report.wrong() && report.looks().find(like) != std::string::npos; }
    std::string describe() const override { return "is wrong: " + like; }
    std::string like;
};

}  // namespace spring_oracle
#endif
