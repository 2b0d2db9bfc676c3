// A grid over points: its cells along a segment, and points by the cell that they are in.
#pragma once
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <stdexcept>
#include <vector>

// A grid of cells that covers points.
class Cells {
 public:
  Cells(const double* points, size_t count, double cell) : cell_(cell) {
    double high[2] = {0, 0};
    for (size_t i = 0; i < count; ++i)
      for (int k = 0; k < 2; ++k) {
        const double v = points[2 * i + k];
        if (!std::isfinite(v)) throw std::invalid_argument("points: finite numbers expected");
        low_[k] = i ? std::min(low_[k], v) : v, high[k] = i ? std::max(high[k], v) : v;
      }
    if (!count) return;
    // However far the points are apart, the grid has no more cells than a few times their number.
    const double most = 16.0 * static_cast<double>(count) + 65536.0;
    while (((high[0] - low_[0]) / cell_ + 1) * ((high[1] - low_[1]) / cell_ + 1) > most) cell_ *= 2;
    for (int k = 0; k < 2; ++k) size_[k] = static_cast<int64_t>((high[k] - low_[k]) / cell_) + 1;
  }

  double cell() const { return cell_; }
  size_t count() const { return static_cast<size_t>(size_[0] * size_[1]); }

  // The cell of one of the points.
  int64_t of(const double* point) const { return index(point[1], 1) * size_[0] + index(point[0], 0); }

  // Calls `use(first, last)` for each run of cells that has all within `reach` of a segment, and some more.
  template <typename F>
  void along(const double* s, double reach, F&& use) const {
    if (!count()) return;
    const double dx = s[2] - s[0], dy = s[3] - s[1];
    const int64_t first = clip(std::floor((std::min(s[1], s[3]) - reach - low_[1]) / cell_), 1);
    const int64_t last = clip(std::floor((std::max(s[1], s[3]) + reach - low_[1]) / cell_), 1);
    for (int64_t row = first; row <= last; ++row) {
      // The part of the segment that is near this row of cells.
      const double bottom = low_[1] + static_cast<double>(row) * cell_ - reach - kSlack;
      const double top = bottom + cell_ + 2 * (reach + kSlack);
      double from = 0, to = 1;
      if (std::abs(dy) > 1e-12) {
        const double a = (bottom - s[1]) / dy, b = (top - s[1]) / dy;
        from = std::max(from, std::min(a, b)), to = std::min(to, std::max(a, b));
        if (from > to) continue;
      }
      const double a = s[0] + from * dx, b = s[0] + to * dx;
      const int64_t left = clip(std::floor((std::min(a, b) - reach - kSlack - low_[0]) / cell_), 0);
      const int64_t right = clip(std::floor((std::max(a, b) + reach + kSlack - low_[0]) / cell_), 0);
      use(row * size_[0] + left, row * size_[0] + right);
    }
  }

 protected:
  double cell_, low_[2] = {0, 0};
  int64_t size_[2] = {0, 0};

 private:
  static constexpr double kSlack = 1e-9;

  int64_t index(double v, int k) const { return static_cast<int64_t>((v - low_[k]) / cell_); }
  int64_t clip(double v, int k) const {
    return static_cast<int64_t>(std::min(std::max(v, 0.0), static_cast<double>(size_[k] - 1)));
  }
};

// Points by the cell of a grid that they are in; within a cell in their order.
class Grid : private Cells {
 public:
  using Cells::cell;

  Grid(const double* points, size_t count, double cell) : Cells(points, count, cell), start_(Cells::count() + 1, 0) {
    std::vector<int64_t> key(count);
    for (size_t i = 0; i < count; ++i) ++start_[(key[i] = of(points + 2 * i)) + 1];
    for (size_t k = 1; k < start_.size(); ++k) start_[k] += start_[k - 1];
    order_.resize(count);
    std::vector<int64_t> next(start_.begin(), start_.end() - 1);
    for (size_t i = 0; i < count; ++i) order_[next[key[i]]++] = static_cast<int64_t>(i);
  }

  // The points, by number, cell by cell.
  const std::vector<int64_t>& order() const { return order_; }

  // Calls `use(first, last)` for runs in the order that have all within a cell's side of a place, and some more.
  template <typename F>
  void beside(double x, double y, F&& use) const {
    if (order_.empty()) return;
    const int64_t column = floor_of((x - low_[0]) / cell_), row = floor_of((y - low_[1]) / cell_);
    const int64_t left = std::max<int64_t>(column - 1, 0), right = std::min(column + 1, size_[0] - 1);
    if (left > right) return;
    for (int64_t j = std::max<int64_t>(row - 1, 0); j <= std::min(row + 1, size_[1] - 1); ++j)
      use(start_[j * size_[0] + left], start_[j * size_[0] + right + 1]);
  }

  // Calls `use(i)` for each point in the cells that are `ring` cells away from the one of a place;
  // returns how far [m] these are at the least.
  template <typename F>
  double around(double x, double y, int64_t ring, F&& use) const {
    if (!order_.empty()) {
      const int64_t column = floor_of((x - low_[0]) / cell_);
      const int64_t row = floor_of((y - low_[1]) / cell_);
      for (int64_t j = std::max<int64_t>(row - ring, 0); j <= std::min(row + ring, size_[1] - 1); ++j) {
        const int64_t step = j == row - ring || j == row + ring || ring == 0 ? 1 : 2 * ring;
        for (int64_t i = column - ring; i <= column + ring; i += step) {
          if (i < 0 || i >= size_[0]) continue;
          const int64_t key = j * size_[0] + i;
          for (int64_t k = start_[key]; k < start_[key + 1]; ++k) use(order_[k]);
        }
      }
    }
    return (static_cast<double>(ring) - 1.0) * cell_;
  }

 private:
  std::vector<int64_t> start_, order_;
};
