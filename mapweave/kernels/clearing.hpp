// What scans saw through: as a raster. The twins and the words are in clearing.py.
#pragma once
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "arrays.hpp"

namespace clearing {

constexpr double kTurn = 6.283185307179586476925286766559;

inline void check(In<int64_t, 1> start, In<double, 2> poses, size_t beams) {
  const size_t n = poses.shape(0);
  if (poses.shape(1) != 3 || start.shape(0) != n + 1 || start.data()[0] != 0 ||
      start.data()[n] != static_cast<int64_t>(beams))
    throw std::invalid_argument("start (n + 1,) from 0 to the beams, poses (n, 3) expected");
  for (size_t k = 0; k < n; ++k)
    if (start.data()[k + 1] < start.data()[k]) throw std::invalid_argument("start: ascending numbers expected");
}

class Raster {
 public:
  Raster(int64_t rows, int64_t columns) : rows_(rows), columns_(columns), cells_(static_cast<size_t>(rows * columns), 0) {
    if (rows < 1 || columns < 1) throw std::invalid_argument("rows, columns: 1 or more expected");
  }

  // Sets the cells whose centres, at whole numbers, are inside a ring of (x, y).
  void fill(const std::vector<double>& ring) {
    const size_t n = ring.size() / 2;
    crossings_.resize(static_cast<size_t>(rows_));
    int64_t low = rows_, high = 0;
    for (size_t k = 0; k < n; ++k) {
      const double *a = ring.data() + 2 * k, *b = ring.data() + 2 * ((k + 1) % n);
      const int64_t first = row(std::min(a[0], b[0])), last = row(std::max(a[0], b[0]));
      for (int64_t r = first; r < last; ++r)
        crossings_[r].push_back(a[1] + (static_cast<double>(r) - a[0]) / (b[0] - a[0]) * (b[1] - a[1]));
      low = std::min(low, first), high = std::max(high, last);
    }
    for (int64_t r = low; r < high; ++r) {
      std::vector<double>& at = crossings_[r];
      std::sort(at.begin(), at.end());
      uint8_t* line = cells_.data() + r * columns_;
      for (size_t k = 0; k + 1 < at.size(); k += 2) {
        const int64_t from = column(at[k]), to = column(at[k + 1]);
        if (to > from) std::fill(line + from, line + to, uint8_t{1});
      }
      at.clear();
    }
  }

  std::vector<uint8_t> take() { return std::move(cells_); }

 private:
  int64_t rows_, columns_;
  std::vector<uint8_t> cells_;
  std::vector<std::vector<double>> crossings_;

  int64_t row(double x) const { return bounded(x, rows_); }
  int64_t column(double y) const { return bounded(y, columns_); }
  static int64_t bounded(double v, int64_t count) {
    return static_cast<int64_t>(std::clamp(std::ceil(v), 0.0, static_cast<double>(count)));
  }
};

inline Out<uint8_t> clear_cells(In<double, 1> angles, In<double, 1> reach, In<int64_t, 1> start, In<double, 2> poses,
                                In<double, 1> origin, double cell, int64_t rows, int64_t columns) {
  if (reach.shape(0) != angles.shape(0) || origin.shape(0) != 2 || !(cell > 0))
    throw std::invalid_argument("angles (b,), reach (b,), origin (2,), cell above 0 expected");
  check(start, poses, angles.shape(0));
  Raster raster(rows, columns);
  std::vector<double> ring;
  for (size_t k = 0; k < poses.shape(0); ++k) {
    const double* pose = poses.data() + 3 * k;
    const double x = (pose[0] - origin.data()[0]) / cell - 0.5, y = (pose[1] - origin.data()[1]) / cell - 0.5;
    const int64_t end = start.data()[k + 1];
    for (int64_t i = start.data()[k]; i < end;) {
      if (!(reach.data()[i] > 0)) {
        ++i;
        continue;
      }
      ring.assign({x, y});
      for (; i < end && reach.data()[i] > 0; ++i) {
        const double angle = pose[2] + angles.data()[i], far = reach.data()[i] / cell;
        ring.insert(ring.end(), {x + far * std::cos(angle), y + far * std::sin(angle)});
      }
      if (ring.size() >= 6) raster.fill(ring);
    }
  }
  return give(raster.take(), {static_cast<size_t>(rows), static_cast<size_t>(columns)});
}

// Squared distances [cells] to the cells that are set, capped: along each row, then across the rows.
inline std::vector<int16_t> squared_distances(const std::vector<uint8_t>& set, int64_t rows, int64_t columns, int16_t most) {
  const int16_t cap = static_cast<int16_t>(most * most);
  std::vector<int16_t> along(set.size()), result(set.size(), cap);
  for (int64_t r = 0; r < rows; ++r) {
    const uint8_t* line = set.data() + r * columns;
    int16_t* out = along.data() + r * columns;
    std::fill(out, out + columns, cap);
    for (int16_t step = 0; step < most && step < columns; ++step) {
      const int16_t squared = static_cast<int16_t>(step * step);
      for (int64_t c = step; c < columns; ++c)
        out[c] = std::min<int16_t>(out[c], line[c - step] ? squared : cap);
      for (int64_t c = 0; c + step < columns; ++c)
        out[c] = std::min<int16_t>(out[c], line[c + step] ? squared : cap);
    }
  }
  for (int64_t r = 0; r < rows; ++r)
    for (int64_t other = std::max<int64_t>(r - most + 1, 0); other < std::min(r + most, rows); ++other) {
      const int16_t more = static_cast<int16_t>((other - r) * (other - r));
      const int16_t* from = along.data() + other * columns;
      int16_t* out = result.data() + r * columns;
      for (int64_t c = 0; c < columns; ++c) out[c] = std::min<int16_t>(out[c], static_cast<int16_t>(from[c] + more));
    }
  return result;
}

inline Out<float> from_core(In<uint8_t, 2> free, int64_t depth) {
  const int64_t rows = static_cast<int64_t>(free.shape(0)), columns = static_cast<int64_t>(free.shape(1));
  if (depth < 1 || depth > 100) throw std::invalid_argument("depth: 1 to 100 expected");
  // What lies beyond the raster is not free.
  const int64_t wide = columns + 2;
  std::vector<uint8_t> taken(static_cast<size_t>((rows + 2) * wide), 1);
  for (int64_t r = 0; r < rows; ++r)
    for (int64_t c = 0; c < columns; ++c) taken[(r + 1) * wide + c + 1] = free.data()[r * columns + c] ? 0 : 1;
  const std::vector<int16_t> inside = squared_distances(taken, rows + 2, wide, static_cast<int16_t>(depth));
  for (size_t k = 0; k < taken.size(); ++k) taken[k] = inside[k] >= depth * depth ? 1 : 0;
  const std::vector<int16_t> away = squared_distances(taken, rows + 2, wide, static_cast<int16_t>(depth + 1));
  std::vector<float> distance(away.size());
  for (size_t k = 0; k < away.size(); ++k) distance[k] = std::sqrt(static_cast<float>(away[k]));
  return give(std::move(distance), {static_cast<size_t>(rows + 2), static_cast<size_t>(wide)});
}

// Where linearly interpolated values fall below a level, as closed rings with what is below on the
// left (marching squares); two corners that touch across a square are apart.
class Outlines {
 public:
  Outlines(In<float, 2> values, float level)
      : values_(values.data()), rows_(static_cast<int64_t>(values.shape(0))), columns_(static_cast<int64_t>(values.shape(1))), level_(level) {
    for (int64_t r = 0; r < rows_; ++r)
      for (int64_t c = 0; c < columns_; ++c) {
        const bool rim = r == 0 || c == 0 || r == rows_ - 1 || c == columns_ - 1;
        if (rim && below(r, c)) throw std::invalid_argument("values: nothing below the level expected at the rim");
      }
    seen_.assign(values.size(), 0);
    for (int64_t r = 0; r + 1 < rows_; ++r)
      for (int64_t c = 0; c + 1 < columns_; ++c) {
        const int count = below(r, c) + below(r + 1, c) + below(r + 1, c + 1) + below(r, c + 1);
        if (count == 0 || count == 4) continue;
        for (int edge = 0; edge < 4; ++edge)
          if (leaves(r, c, edge) && !(seen_[r * columns_ + c] & (1 << edge))) follow(r, c, edge);
      }
  }

  std::vector<double> points;
  std::vector<int64_t> start{0};

 private:
  const float* values_;
  int64_t rows_, columns_;
  float level_;
  std::vector<uint8_t> seen_;

  // Corners of a square, and the squares beyond its edges, counterclockwise.
  static constexpr int kCorner[5][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}, {0, 0}};
  static constexpr int kBeyond[4][2] = {{0, -1}, {1, 0}, {0, 1}, {-1, 0}};

  bool below(int64_t r, int64_t c) const { return values_[r * columns_ + c] < level_; }
  bool at(int64_t r, int64_t c, int corner) const { return below(r + kCorner[corner][0], c + kCorner[corner][1]); }
  bool leaves(int64_t r, int64_t c, int edge) const { return at(r, c, edge) && !at(r, c, edge + 1); }
  bool enters(int64_t r, int64_t c, int edge) const { return !at(r, c, edge) && at(r, c, edge + 1); }

  void follow(int64_t r, int64_t c, int edge) {
    while (!(seen_[r * columns_ + c] & (1 << edge))) {
      seen_[r * columns_ + c] |= static_cast<uint8_t>(1 << edge);
      const int64_t ar = r + kCorner[edge][0], ac = c + kCorner[edge][1];
      const int64_t br = r + kCorner[edge + 1][0], bc = c + kCorner[edge + 1][1];
      const double a = values_[ar * columns_ + ac], b = values_[br * columns_ + bc], part = (level_ - a) / (b - a);
      points.push_back(static_cast<double>(ar) + part * static_cast<double>(br - ar));
      points.push_back(static_cast<double>(ac) + part * static_cast<double>(bc - ac));
      do edge = (edge + 3) % 4;
      while (!enters(r, c, edge));
      r += kBeyond[edge][0], c += kBeyond[edge][1];
      edge = (edge + 2) % 4;
    }
    start.push_back(static_cast<int64_t>(points.size() / 2));
  }
};

inline auto outlines(In<float, 2> values, float level) {
  Outlines found(values, level);
  const size_t points = found.points.size() / 2, rings = found.start.size();
  return std::make_tuple(give(std::move(found.points), {points, 2}), give(std::move(found.start), {rings}));
}

}  // namespace clearing

inline void bind_clearing(nb::module_& m) {
  m.def("clear_cells", &clearing::clear_cells, nb::arg("angles"), nb::arg("reach"), nb::arg("start"), nb::arg("poses"),
        nb::arg("origin"), nb::arg("cell"), nb::arg("rows"), nb::arg("columns"));
  m.def("from_core", &clearing::from_core, nb::arg("free"), nb::arg("depth"));
  m.def("outlines", &clearing::outlines, nb::arg("values"), nb::arg("level"));
}
