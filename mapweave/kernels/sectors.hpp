// Beams by sectors: most points are known to lie before what was hit, or not, without their angle.
#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

namespace sectors {

constexpr double kTurn = 6.283185307179586476925286766559;
constexpr double kHalfTurn = kTurn / 2;
constexpr int kCount = 256;  // of about 1.4 degrees
constexpr double kRounding = 1e-6;  // [beams] by which an angle may err

// Grows with the angle of (x, y), 0 to kCount, and needs no arc tangent.
inline double pseudo_angle(double x, double y) {
  const double across = std::abs(x) + std::abs(y), p = across > 0 ? y / across : 0.0;
  const double quarters = x < 0 ? 2 - p : (y < 0 ? 4 + p : p);
  return quarters * (kCount / 4);
}

// Where each sector begins [rad], in 0 to a turn.
inline const std::array<double, kCount + 1>& borders() {
  static const std::array<double, kCount + 1> angles = [] {
    std::array<double, kCount + 1> found{};
    for (int k = 0; k < kCount; ++k) {
      const double quarters = 4.0 * k / kCount, p = quarters - std::floor(quarters);
      const double within = std::atan2(p, 1 - p);
      found[k] = std::floor(quarters) * (kTurn / 4) + within;
    }
    found[kCount] = kTurn;
    return found;
  }();
  return angles;
}

// What beams saw through, (beams,) `clear` [m] each, from the angle `first` on, `spacing` apart [rad].
class Beams {
 public:
  Beams(const double* clear, int64_t count, double first, double spacing, double clearance)
      : clear_(clear), count_(count), first_(first), spacing_(spacing), clearance_(clearance) {
    closed_ = count * spacing > kTurn - spacing / 2;
    const std::array<double, kCount + 1>& border = borders();
    for (int k = 0; k < kCount; ++k) bound(k, border[k], border[k + 1]);
  }

  // Whether the point (x, y), sensor frame, of a `squared` distance, lies before what its beam hit.
  bool before(double x, double y, double squared) const {
    const int sector = static_cast<int>(pseudo_angle(x, y)) & (kCount - 1);
    if (squared < surely_[sector]) return true;
    if (!(squared < perhaps_[sector])) return false;
    double steps = std::fmod(std::atan2(y, x) - first_, kTurn);
    if (steps < 0) steps += kTurn;
    steps /= spacing_;
    if (!(steps <= count_ - 1 || closed_)) return false;
    int64_t beam = std::llrint(steps);
    if (beam >= count_) beam = 0;
    return squared < limit(clear_[beam]);
  }

 private:
  const double* clear_;
  int64_t count_;
  double first_, spacing_, clearance_;
  bool closed_;
  std::array<double, kCount> surely_, perhaps_;  // [m²] before which a point is so, or may be

  double limit(double clear) const {
    const double before = clear - clearance_;
    return before > 0 ? before * before : 0.0;
  }

  // Bounds what the beams of a sector, and those beside it, saw through.
  void bound(int sector, double from, double to) {
    const double turn = from - first_ - kTurn * std::floor((from - first_) / kTurn);
    const int64_t low = static_cast<int64_t>(std::floor(turn / spacing_ - 0.5 - kRounding));
    const int64_t high = static_cast<int64_t>(std::ceil((turn + to - from) / spacing_ + 0.5 + kRounding));
    double least = std::numeric_limits<double>::infinity(), most = 0;
    if (low < 0 || high >= count_) {  // where beams end or begin anew, all of them may be meant
      surely_[sector] = 0, perhaps_[sector] = std::numeric_limits<double>::infinity();
      return;
    }
    for (int64_t beam = low; beam <= high; ++beam) {
      least = std::min(least, clear_[beam]), most = std::max(most, clear_[beam]);
    }
    surely_[sector] = limit(least), perhaps_[sector] = limit(most);
  }
};

}  // namespace sectors
