// How far a point goes in a given number of steps, as a sum of its motion in each of the last
// steps. All points and axes share the coefficients. They are fitted by least squares with
// exponential forgetting: linear prediction (Makhoul, Proceedings of the IEEE 63, 1975), which was
// used on the beating heart by Franke, Bebek and Cavusoglu (IROS 2007).
#pragma once
#include <Eigen/Core>

namespace defrec {

class LagModel {
  public:
    LagModel(int horizon, double step_s);

    // The way of a damped velocity in so many steps, times its last step.
    static double damped(int horizon, double step_s);

    void forget(double seconds);
    // motions: in the last steps, a column for each equation, the latest first; reached: how far
    // the point went.
    void learn(const Eigen::Ref<const Eigen::MatrixXd>& motions,
               const Eigen::Ref<const Eigen::VectorXd>& reached);
    void solve();
    const Eigen::VectorXd& coefficients() const { return coefficients_; }

  private:
    Eigen::MatrixXd normal_;
    Eigen::VectorXd right_, prior_, coefficients_;
};

}  // namespace defrec
