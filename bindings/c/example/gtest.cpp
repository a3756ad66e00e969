// Predicates for GoogleTest, and the messages of their failures.
#include <gtest/gtest-spi.h>
#include <spring_oracle_gtest.hpp>

using spring_oracle::check_jacobian, spring_oracle::is_correct, spring_oracle::is_wrong;

static Eigen::VectorXd squares(const Eigen::VectorXd& x) { return x.array().square(); }
static Eigen::MatrixXd right(const Eigen::VectorXd& x) { return (2 * x).asDiagonal(); }
static Eigen::MatrixXd negated(const Eigen::VectorXd& x) { return (-2 * x).asDiagonal(); }
static const Eigen::VectorXd at = Eigen::Vector3d(0.3, -0.7, 1.9);

TEST(Jacobian, RightIsCorrect) { EXPECT_TRUE(is_correct(check_jacobian(squares, right, at))); }
TEST(Jacobian, NegatedIsNamed) { EXPECT_TRUE(is_wrong(check_jacobian(squares, negated, at), "exactly the negative")); }
TEST(Jacobian, FailuresPrintTheReport) {
    EXPECT_NONFATAL_FAILURE(EXPECT_TRUE(is_correct(check_jacobian(squares, negated, at))), "exactly the negative");
    EXPECT_NONFATAL_FAILURE(EXPECT_TRUE(is_wrong(check_jacobian(squares, right, at))), "3 x 3 Jacobian: correct");
    EXPECT_NONFATAL_FAILURE(EXPECT_TRUE(is_wrong(check_jacobian(squares, negated, at), "factor")), "exactly the negative");
}
