// Rigid motions of the plane, as `mapweave.geometry.se2` has them.
#pragma once
#include <cmath>

namespace motions {

constexpr double kTurn = 6.283185307179586476925286766559;
constexpr double kHalfTurn = kTurn / 2;

// In (-pi, pi].
inline double wrap(double angle) {
  const double apart = std::fmod(kHalfTurn - angle, kTurn);
  return kHalfTurn - (apart < 0 ? apart + kTurn : apart);
}

struct Motion {
  double x, y, theta;

  Motion inverse() const {
    const double c = std::cos(theta), s = std::sin(theta);
    return {-c * x - s * y, s * x - c * y, wrap(-theta)};
  }
};

}  // namespace motions
