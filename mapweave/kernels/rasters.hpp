// A line map as a raster. The twins and the words are in matching/rasters.py.
#pragma once
#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "arrays.hpp"

namespace rasters {

constexpr int32_t kNone = -(1 << 30);  // farther than any row
constexpr size_t kAtOnce = 16;  // cells that are looked at together: most are near no wall

// The nearest seed so far, row `i` and above: its row.
MAPWEAVE_WIDE inline void go_down(int32_t* __restrict row, const int32_t* __restrict above,
                                  const uint8_t* __restrict seeds, int32_t columns, int32_t i) {
  for (int32_t j = 0; j < columns; ++j) row[j] = seeds[j] ? i : above[j];
}

// So far the nearest seed above; from below where that is nearer.
MAPWEAVE_WIDE inline void go_up(int32_t* __restrict row, const int32_t* __restrict below, int32_t columns, int32_t i) {
  for (int32_t j = 0; j < columns; ++j) row[j] = (below[j] > i) & (below[j] - i < i - row[j]) ? below[j] : row[j];
}

// [m] of squared cells.
MAPWEAVE_WIDE inline void measure(float* __restrict metres, const double* __restrict squared, int32_t count,
                                  double cell) {
  for (int32_t k = 0; k < count; ++k) metres[k] = static_cast<float>(std::sqrt(squared[k]) * cell);
}

// The nearest seed to each cell and how far it is: column by column, then the lower envelope of each row's parabolas.
// Of seeds equally near, the one in the lower column, then the lower row.
class Distances {
 public:
  Distances(int32_t rows, int32_t columns)
      : rows_(rows), columns_(columns), row_(static_cast<size_t>(rows) * columns), stack_(columns), from_(columns),
        height_(columns), squared_(columns) {}

  // Calls `tell(first cell, cells, seed's cell)` for runs of cells, `end_row(row, squared cells to the seeds)` for rows.
  // `seeds`: which cells are, one at least.
  template <typename Tell, typename EndRow>
  void find(const uint8_t* seeds, Tell tell, EndRow end_row) {
    const std::vector<int32_t> none(columns_, kNone);
    for (int32_t i = 0; i < rows_; ++i)
      go_down(row(i), i > 0 ? row(i - 1) : none.data(), seeds + static_cast<size_t>(i) * columns_, columns_, i);
    for (int32_t i = rows_ - 2; i >= 0; --i) go_up(row(i), row(i + 1), columns_, i);
    for (int32_t i = 0; i < rows_; ++i) {
      for (int32_t j = 0, end = 0; j < columns_; j = end) {
        for (end = j; end < columns_ && row(i)[end] == i; ++end) tell_seed(i, end, tell);
        const int32_t first = end;
        while (end < columns_ && row(i)[end] != i) ++end;
        if (end > first) between_seeds(i, first, end, tell);
      }
      end_row(i, squared_.data());
    }
  }

 private:
  int32_t* row(int32_t i) { return row_.data() + static_cast<size_t>(i) * columns_; }

  template <typename Tell>
  void tell_seed(int32_t i, int32_t j, Tell tell) {
    const size_t cell = static_cast<size_t>(i) * columns_ + j;
    tell(cell, 1, cell);
    squared_[j] = 0;
  }

  // Of cells of a row between two that are seeds: no seed beyond those is nearer.
  template <typename Tell>
  void between_seeds(int32_t i, int32_t first, int32_t end, Tell tell) {
    const size_t begin = static_cast<size_t>(i) * columns_;
    const int32_t count = across(i, std::max(first - 1, 0), std::min(end + 1, columns_));
    for (int32_t k = 0; k < count; ++k) {
      const int32_t column = stack_[k], low = std::max(static_cast<int32_t>(from_[k]), first);
      const int32_t high = std::min(k + 1 < count ? static_cast<int32_t>(from_[k + 1]) : end, end);
      if (high <= low) continue;
      tell(begin + low, static_cast<size_t>(high - low), static_cast<size_t>(row(i)[column]) * columns_ + column);
      for (int32_t j = low; j < high; ++j) {
        const double apart = j - column;
        squared_[j] = apart * apart + static_cast<double>(height_[column]);
      }
    }
  }

  // How many columns from `first` to before `end` have cells in row `i` to which their seed is nearest: `stack_`, each
  // from `from_` on.
  int32_t across(int32_t i, int32_t first, int32_t end) {
    const int32_t* nearest = row(i);
    int32_t count = 0;
    for (int32_t j = first; j < end; ++j) {
      if (nearest[j] == kNone) continue;
      const int64_t apart = nearest[j] - i;
      height_[j] = apart * apart;
      while (count > 0 && sum(stack_[count - 1], j) < from_[count - 1] * twice(stack_[count - 1], j)) --count;
      if (count > 0 && sum(stack_[count - 1], j) >= (end - 1) * twice(stack_[count - 1], j)) continue;
      from_[count] = count > 0 ? first_nearer(stack_[count - 1], j) : first;
      stack_[count++] = j;
    }
    return count;
  }

  // The seeds of columns `a` and `b` after it are as far from where the sum is by twice the column.
  int64_t sum(int32_t a, int32_t b) const {
    return static_cast<int64_t>(b) * b - static_cast<int64_t>(a) * a + height_[b] - height_[a];
  }
  static int64_t twice(int32_t a, int32_t b) { return 2 * static_cast<int64_t>(b - a); }

  // The first column from which on the seed of column `b` is nearer than that of column `a` before it.
  int64_t first_nearer(int32_t a, int32_t b) const {
    if (b == a + 1 && height_[a] == height_[b]) return b;
    // Exact: quotients of whole numbers so small are no nearer to a whole number than rounding moves them.
    return static_cast<int64_t>(static_cast<double>(sum(a, b)) / static_cast<double>(twice(a, b))) + 1;
  }

  int32_t rows_, columns_;
  std::vector<int32_t> row_;  // of the seed nearest in the column
  std::vector<int32_t> stack_;
  std::vector<int64_t> from_, height_;
  std::vector<double> squared_;
};

inline int32_t side(int64_t cells, const char* message) {
  if (cells < 1 || cells > 1'000'000) throw std::invalid_argument(message);
  return static_cast<int32_t>(cells);
}

inline std::pair<int32_t, int32_t> sides(int64_t rows, int64_t columns) {
  const char* message = "rows and columns: 1 to 1000000 expected, 2**30 cells at most";
  const int32_t r = side(rows, message), c = side(columns, message);
  if (static_cast<int64_t>(r) * c > (int64_t{1} << 30)) throw std::invalid_argument(message);
  return {r, c};
}

// Where cells are: the corner of the first one, how wide they are [m], and how many.
struct Frame {
  double x, y, cell;
  int32_t rows, columns;

  size_t size() const { return static_cast<size_t>(rows) * columns; }
};

inline Frame frame_of(In<double, 1> origin, double cell, int64_t rows, int64_t columns) {
  const auto [r, c] = sides(rows, columns);
  if (origin.shape(0) != 2 || !(cell > 0)) throw std::invalid_argument("origin (2,), cell > 0 expected");
  return {origin(0), origin(1), cell, r, c};
}

// Index of, and distance to, the sample nearest to each cell.
inline std::pair<std::vector<int32_t>, std::vector<float>> nearest_samples(const std::vector<double>& points,
                                                                           const Frame& frame) {
  const int32_t r = frame.rows, c = frame.columns;
  std::vector<int32_t> owner(frame.size());
  std::vector<uint8_t> seeds(owner.size(), 0);
  for (size_t k = 0; 2 * k < points.size(); ++k) {
    const double x = std::floor((points[2 * k] - frame.x) / frame.cell);
    const double y = std::floor((points[2 * k + 1] - frame.y) / frame.cell);
    if (!(x >= 0 && y >= 0 && x < r && y < c)) throw std::invalid_argument("points: inside of the raster expected");
    const size_t at = static_cast<size_t>(x) * c + static_cast<size_t>(y);
    owner[at] = static_cast<int32_t>(k);
    seeds[at] = 1;
  }
  std::vector<int32_t> nearest(owner.size());
  std::vector<float> metres(owner.size());
  Distances(r, c).find(
      seeds.data(),
      [&](size_t at, size_t count, size_t seed) { std::fill_n(nearest.begin() + at, count, owner[seed]); },
      [&](int32_t i, const double* squared) {
        measure(metres.data() + static_cast<size_t>(i) * c, squared, c, frame.cell);
      });
  return {std::move(nearest), std::move(metres)};
}

// Marks the cells whose centres are inside of a polygon: in each row between an odd crossing and the next.
class Filling {
 public:
  Filling(int32_t rows, int32_t columns, std::vector<uint8_t>& filled)
      : rows_(rows), columns_(columns), filled_(filled) {}

  // `corners` in cells, cell centres at whole numbers.
  void add(const std::vector<std::pair<double, double>>& corners) {
    crossings_.clear();
    for (size_t k = 0; k < corners.size(); ++k) cross(corners[k], corners[(k + 1) % corners.size()]);
    std::sort(crossings_.begin(), crossings_.end());
    for (size_t k = 0; k + 1 < crossings_.size(); k += 2) {
      uint8_t* row = filled_.data() + static_cast<size_t>(crossings_[k].first) * columns_;
      std::fill(row + crossings_[k].second, row + crossings_[k + 1].second, uint8_t{1});
    }
  }

 private:
  void cross(const std::pair<double, double>& start, const std::pair<double, double>& end) {
    const auto bounded = [](double v, int32_t most) { return static_cast<int32_t>(std::clamp<double>(v, 0, most)); };
    const int32_t low = bounded(std::ceil(std::min(start.first, end.first)), rows_);
    const int32_t high = bounded(std::ceil(std::max(start.first, end.first)), rows_);
    const double run = end.first - start.first, rise = end.second - start.second;
    for (int32_t i = low; i < high; ++i) {
      const double column = start.second + (i - start.first) / run * rise;
      crossings_.emplace_back(i, bounded(std::ceil(column), columns_));
    }
  }

  int32_t rows_, columns_;
  std::vector<uint8_t>& filled_;
  std::vector<std::pair<int32_t, int32_t>> crossings_;
};

using Rings = std::vector<In<double, 2>>;

inline std::vector<uint8_t> fill(const Rings& rings, const Frame& frame) {
  std::vector<uint8_t> filled(frame.size(), 0);
  Filling filling(frame.rows, frame.columns, filled);
  std::vector<std::pair<double, double>> polygon;
  for (const auto& corners : rings) {
    if (corners.shape(1) != 2) throw std::invalid_argument("polygons (k, 2) expected");
    polygon.clear();
    for (size_t k = 0; k < corners.shape(0); ++k) {
      const double x = (corners(k, 0) - frame.x) / frame.cell - 0.5, y = (corners(k, 1) - frame.y) / frame.cell - 0.5;
      if (!(std::isfinite(x) && std::isfinite(y))) throw std::invalid_argument("corners: finite numbers expected");
      polygon.emplace_back(x, y);
    }
    filling.add(polygon);
  }
  return filled;
}

inline Out<uint8_t> filled_cells(const Rings& polygons, In<double, 1> origin, double cell, int64_t rows,
                                 int64_t columns) {
  const Frame frame = frame_of(origin, cell, rows, columns);
  std::vector<uint8_t> filled;
  {
    const nb::gil_scoped_release others_go_on;
    filled = fill(polygons, frame);
  }
  return give(std::move(filled), {static_cast<size_t>(frame.rows), static_cast<size_t>(frame.columns)});
}

// [m] from the edge of what is filled inwards; beyond the raster nothing is.
inline std::vector<float> depths(const Rings& polygons, const Frame& frame) {
  const int32_t r = frame.rows, c = frame.columns;
  const std::vector<uint8_t> filled = fill(polygons, frame);
  std::vector<uint8_t> empty(static_cast<size_t>(r + 2) * (c + 2), 1);
  for (int32_t i = 0; i < r; ++i)
    for (int32_t j = 0; j < c; ++j)
      empty[static_cast<size_t>(i + 1) * (c + 2) + j + 1] = !filled[static_cast<size_t>(i) * c + j];
  std::vector<float> depth(filled.size());
  Distances(r + 2, c + 2).find(
      empty.data(), [](size_t, size_t, size_t) {},
      [&](int32_t i, const double* squared) {
        if (i > 0 && i <= r) measure(depth.data() + static_cast<size_t>(i - 1) * c, squared + 1, c, frame.cell);
      });
  return depth;
}

// What cells say that are near no wall: that they were seen through, or nothing.
MAPWEAVE_WIDE inline void tell_space(uint8_t* __restrict codes, const float* __restrict depth, size_t count, float deep,
                                     uint8_t nothing) {
  for (size_t k = 0; k < count; ++k) codes[k] = static_cast<uint8_t>(nothing + (depth[k] > deep));
}

inline bool any_below(const float* values, size_t count, float limit) {
  int any = 0;
  for (size_t k = 0; k < count; ++k) any |= values[k] < limit;
  return any != 0;
}

// What each cell says: where the wall near it faces, that it was seen through, or nothing.
inline Out<uint8_t> cell_codes(In<int32_t, 2> nearest, In<float, 2> distance, In<float, 2> depth, In<double, 1> facing,
                               double closeness, double clearance, int64_t directions) {
  if (directions < 1 || directions > 254) throw std::invalid_argument("1 to 254 directions expected");
  for (const auto& other : {distance, depth})
    if (other.shape(0) != nearest.shape(0) || other.shape(1) != nearest.shape(1))
      throw std::invalid_argument("nearest, distance and depth: of one shape expected");
  const float close = static_cast<float>(closeness), deep = static_cast<float>(clearance);
  std::vector<uint8_t> faces(facing.shape(0));
  for (size_t k = 0; k < faces.size(); ++k)
    faces[k] = static_cast<uint8_t>(static_cast<int64_t>(facing(k) * static_cast<double>(directions)) % directions);
  std::vector<uint8_t> codes(nearest.size());
  tell_space(codes.data(), depth.data(), codes.size(), deep, static_cast<uint8_t>(directions));
  for (size_t k = 0; k < codes.size(); ++k) {
    if (k % kAtOnce == 0 && !any_below(distance.data() + k, std::min(kAtOnce, codes.size() - k), close)) {
      k += kAtOnce - 1;  // none of these
      continue;
    }
    if (!(distance.data()[k] < close)) continue;
    const int64_t sample = nearest.data()[k];
    if (sample < 0 || sample >= static_cast<int64_t>(faces.size()))
      throw std::invalid_argument("nearest: numbers of samples expected");
    codes[k] = faces[sample];
  }
  return give(std::move(codes), {nearest.shape(0), nearest.shape(1)});
}

}  // namespace rasters

inline void bind_rasters(nb::module_& m) {
  m.def("filled_cells", &rasters::filled_cells, nb::arg("polygons"), nb::arg("origin"), nb::arg("cell"),
        nb::arg("rows"), nb::arg("columns"));
  m.def("cell_codes", &rasters::cell_codes, nb::arg("nearest"), nb::arg("distance"), nb::arg("depth"),
        nb::arg("facing"), nb::arg("closeness"), nb::arg("clearance"), nb::arg("directions"));
}
