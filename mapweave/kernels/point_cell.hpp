// The points of one cell of a grid, laid out so that several are measured at once.
#pragma once
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

namespace point_map {

// Two numbers that are computed with at once; GCC and Clang do so on every machine, if it can or not.
using Pair = double __attribute__((vector_size(2 * sizeof(double))));

constexpr size_t kLanes = 4;  // points that are measured together

struct Point {
  double x, y, u, v;  // place [m], normal times its weight [m]
  double nx, ny;      // unit normal
  int64_t number;     // in the order of adding
  int32_t tag;        // polyline, -1 for none

  double squared(double to_x, double to_y, double to_u, double to_v) const {
    const double dx = x - to_x, dy = y - to_y, du = u - to_u, dv = v - to_v;
    return dx * dx + dy * dy + (du * du + dv * dv);
  }
};

class Cell {
 public:
  bool empty() const { return points_.empty(); }

  void add(const Point& point) {
    points_.push_back(point);
    lay_out(points_.size() - 1);
  }

  void remove(int64_t number) {
    const auto at = std::find_if(points_.begin(), points_.end(), [&](const Point& p) { return p.number == number; });
    const auto first = static_cast<size_t>(at - points_.begin());
    points_.erase(at);
    lay_out(first);
  }

  // Calls `visit` with each point that is as near as `bound` [m²], and its squared distance; the visitor may
  // lower the bound. Most are farther, and several are told so at once.
  template <typename Visit>
  void within(double x, double y, double u, double v, const double& bound, Visit&& visit) const {
    const Pair at[4] = {{x, x}, {y, y}, {u, u}, {v, v}};
    for (size_t first = 0; first < points_.size(); first += kLanes) {
      const Block& block = blocks_[first / kLanes];
      const Pair squared[2] = {block.squared(0, at), block.squared(1, at)};
      if (least(squared) > bound) continue;
      for (size_t k = 0; k < kLanes; ++k)
        if (squared[k / 2][k % 2] <= bound && first + k < points_.size())
          visit(points_[first + k], squared[k / 2][k % 2]);
    }
  }

  // Whether a point is nearer than `limit` [m²].
  bool any_within(double x, double y, double u, double v, double limit) const {
    const Pair at[4] = {{x, x}, {y, y}, {u, u}, {v, v}};
    for (const Block& block : blocks_) {
      const Pair squared[2] = {block.squared(0, at), block.squared(1, at)};
      if (least(squared) < limit) return true;
    }
    return false;
  }

 private:
  struct Block {
    Pair x[2], y[2], u[2], v[2];  // infinitely far where there is no point

    // Of two of the points; term by term as `Point::squared`, so that both are the same number.
    Pair squared(size_t half, const Pair* at) const {
      const Pair dx = x[half] - at[0], dy = y[half] - at[1], du = u[half] - at[2], dv = v[half] - at[3];
      return dx * dx + dy * dy + (du * du + dv * dv);
    }
  };

  std::vector<Point> points_;
  std::vector<Block> blocks_;  // the same places and normals

  static double least(const Pair* squared) {
    return std::min(std::min(squared[0][0], squared[0][1]), std::min(squared[1][0], squared[1][1]));
  }

  // Lays the points out anew, from a number on.
  void lay_out(size_t from) {
    constexpr double far = std::numeric_limits<double>::infinity();
    blocks_.resize((points_.size() + kLanes - 1) / kLanes);
    for (size_t i = from; i < blocks_.size() * kLanes; ++i) {
      Block& block = blocks_[i / kLanes];
      const size_t half = i % kLanes / 2, k = i % 2;
      const Point point = i < points_.size() ? points_[i] : Point{far, far, far, far, 0, 0, -1, -1};
      block.x[half][k] = point.x, block.y[half][k] = point.y;
      block.u[half][k] = point.u, block.v[half][k] = point.v;
    }
  }
};

}  // namespace point_map
