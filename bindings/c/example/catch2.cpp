// Matchers of Catch2. The tests tagged [!shouldfail] are expected to fail.
#define CATCH_CONFIG_MAIN  // version 2; version 3 links its main function
#include <spring_oracle_catch2.hpp>
#if __has_include(<catch2/catch_test_macros.hpp>)
#include <catch2/catch_test_macros.hpp>
#endif

using spring_oracle::check_jacobian, spring_oracle::IsCorrect, spring_oracle::IsWrong;

static Eigen::VectorXd squares(const Eigen::VectorXd& x) { return x.array().square(); }
static Eigen::MatrixXd right(const Eigen::VectorXd& x) { return (2 * x).asDiagonal(); }
static Eigen::MatrixXd negated(const Eigen::VectorXd& x) { return (-2 * x).asDiagonal(); }
static const Eigen::VectorXd at = Eigen::Vector3d(0.3, -0.7, 1.9);

TEST_CASE("a right Jacobian") { REQUIRE_THAT(check_jacobian(squares, right, at), IsCorrect()); }
TEST_CASE("a negated one is named") { REQUIRE_THAT(check_jacobian(squares, negated, at), IsWrong("exactly the negative")); }
TEST_CASE("a wrong one is not correct", "[!shouldfail]") { CHECK_THAT(check_jacobian(squares, negated, at), IsCorrect()); }
TEST_CASE("a right one is not wrong", "[!shouldfail]") { CHECK_THAT(check_jacobian(squares, right, at), IsWrong()); }
TEST_CASE("a negated one is not a factor", "[!shouldfail]") { CHECK_THAT(check_jacobian(squares, negated, at), IsWrong("factor")); }
