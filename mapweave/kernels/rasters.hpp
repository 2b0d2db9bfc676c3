// A line map as a raster. The twins and the words are in matching/rasters.py.
#pragma once
#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "arrays.hpp"

namespace rasters {

constexpr int32_t kNone = -1;

// The nearest seed to each cell and how far it is: column by column, then the lower envelope of each row's parabolas.
// Of seeds equally near, the one in the lower column, then the lower row.
class Distances {
 public:
  Distances(int32_t rows, int32_t columns)
      : rows_(rows), columns_(columns), row_(static_cast<size_t>(rows) * columns, kNone), stack_(columns),
        from_(columns), height_(columns) {}

  // Calls `tell(cell, columns from the seed, squared rows from it, seed's cell)`; nothing where there is no seed.
  template <typename IsSeed, typename Tell>
  void find(IsSeed is_seed, Tell tell) {
    down(is_seed);
    up();
    for (int32_t i = 0; i < rows_; ++i) {
      const int32_t count = across(i);
      for (int32_t k = 0; k < count; ++k) {
        const int32_t column = stack_[k], first = static_cast<int32_t>(from_[k]);
        const int32_t last = k + 1 < count ? static_cast<int32_t>(from_[k + 1]) : columns_;
        const size_t begin = static_cast<size_t>(i) * columns_;
        tell(begin + first, static_cast<size_t>(last - first), first - column, height_[column],
             static_cast<size_t>(row_[begin + column]) * columns_ + column);
      }
    }
  }

 private:
  template <typename IsSeed>
  void down(IsSeed is_seed) {
    for (int32_t i = 0; i < rows_; ++i) {
      int32_t* row = row_.data() + static_cast<size_t>(i) * columns_;
      for (int32_t j = 0; j < columns_; ++j)
        row[j] = is_seed(i, j) ? i : (i > 0 ? row[j - columns_] : kNone);
    }
  }

  // So far the nearest seed above; from below where that is nearer.
  void up() {
    for (int32_t i = rows_ - 2; i >= 0; --i) {
      int32_t* row = row_.data() + static_cast<size_t>(i) * columns_;
      for (int32_t j = 0; j < columns_; ++j) {
        const int32_t below = row[j + columns_];
        if (below > i && (row[j] == kNone || below - i < i - row[j])) row[j] = below;
      }
    }
  }

  // How many columns of row `i` have cells to which their seed is nearest: `stack_`, each from `from_` on.
  int32_t across(int32_t i) {
    const int32_t* row = row_.data() + static_cast<size_t>(i) * columns_;
    int32_t count = 0;
    for (int32_t j = 0; j < columns_; ++j) {
      if (row[j] == kNone) continue;
      const int64_t apart = row[j] - i;
      height_[j] = apart * apart;
      int64_t begins = 0;
      while (count > 0) {
        begins = first_nearer(stack_[count - 1], j);
        if (begins > from_[count - 1]) break;
        --count;
      }
      if (count == 0) begins = 0;
      if (begins >= columns_) continue;
      stack_[count] = j;
      from_[count++] = begins;
    }
    return count;
  }

  // The first column from which on the seed of column `b` is nearer than that of column `a` before it.
  int64_t first_nearer(int32_t a, int32_t b) const {
    const int64_t higher = height_[b] - height_[a];
    if (b == a + 1 && higher == 0) return b;
    const int64_t sum = static_cast<int64_t>(b) * b - static_cast<int64_t>(a) * a + higher;
    const int64_t twice = 2 * static_cast<int64_t>(b - a);
    // Exact: quotients of whole numbers so small are no nearer to a whole number than rounding moves them.
    return sum < 0 ? 0 : static_cast<int64_t>(static_cast<double>(sum) / static_cast<double>(twice)) + 1;
  }

  int32_t rows_, columns_;
  std::vector<int32_t> row_;  // of the seed nearest in the column
  std::vector<int32_t> stack_;
  std::vector<int64_t> from_, height_;
};

// [m] for a run of cells of one row.
inline void measure(float* metres, size_t count, int64_t off, int64_t height, double cell) {
  for (size_t k = 0; k < count; ++k) {
    const double apart = static_cast<double>(off) + static_cast<double>(k);
    metres[k] = static_cast<float>(std::sqrt(apart * apart + static_cast<double>(height)) * cell);
  }
}

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

// Index of, and distance to, the sample nearest to each cell.
inline std::pair<Out<int32_t>, Out<float>> nearest_samples(In<double, 2> points, In<double, 1> origin, double cell,
                                                           int64_t rows, int64_t columns) {
  const auto [r, c] = sides(rows, columns);
  if (points.shape(1) != 2 || points.shape(0) == 0 || origin.shape(0) != 2 || !(cell > 0))
    throw std::invalid_argument("points (n, 2), one at least, origin (2,), cell > 0 expected");
  std::vector<int32_t> owner(static_cast<size_t>(r) * c, kNone);
  for (size_t k = 0; k < points.shape(0); ++k) {
    const double x = std::floor((points(k, 0) - origin(0)) / cell), y = std::floor((points(k, 1) - origin(1)) / cell);
    if (!(x >= 0 && y >= 0 && x < r && y < c)) throw std::invalid_argument("points: inside of the raster expected");
    owner[static_cast<size_t>(x) * c + static_cast<size_t>(y)] = static_cast<int32_t>(k);
  }
  std::vector<int32_t> nearest(owner.size());
  std::vector<float> metres(owner.size());
  Distances(r, c).find([&, c = c](int32_t i, int32_t j) { return owner[static_cast<size_t>(i) * c + j] != kNone; },
                       [&](size_t at, size_t count, int64_t off, int64_t height, size_t seed) {
                         std::fill_n(nearest.begin() + at, count, owner[seed]);
                         measure(metres.data() + at, count, off, height, cell);
                       });
  return {give(std::move(nearest), {owner.size() / c, static_cast<size_t>(c)}),
          give(std::move(metres), {owner.size() / c, static_cast<size_t>(c)})};
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

inline std::vector<uint8_t> fill(In<double, 2> corners, In<int64_t, 1> starts, In<double, 1> origin, double cell,
                                 int32_t rows, int32_t columns) {
  const size_t n = corners.shape(0);
  if (corners.shape(1) != 2 || origin.shape(0) != 2 || !(cell > 0) || starts.shape(0) < 1 || starts(0) != 0 ||
      starts(starts.shape(0) - 1) != static_cast<int64_t>(n))
    throw std::invalid_argument("corners (n, 2), starts (k + 1,) from 0 to n, origin (2,), cell > 0 expected");
  std::vector<uint8_t> filled(static_cast<size_t>(rows) * columns, 0);
  Filling filling(rows, columns, filled);
  std::vector<std::pair<double, double>> polygon;
  for (size_t p = 0; p + 1 < starts.shape(0); ++p) {
    if (starts(p + 1) < starts(p)) throw std::invalid_argument("starts: ascending expected");
    polygon.clear();
    for (int64_t k = starts(p); k < starts(p + 1); ++k) {
      const double x = (corners(k, 0) - origin(0)) / cell - 0.5, y = (corners(k, 1) - origin(1)) / cell - 0.5;
      if (!(std::isfinite(x) && std::isfinite(y))) throw std::invalid_argument("corners: finite numbers expected");
      polygon.emplace_back(x, y);
    }
    filling.add(polygon);
  }
  return filled;
}

inline Out<uint8_t> filled_cells(In<double, 2> corners, In<int64_t, 1> starts, In<double, 1> origin, double cell,
                                 int64_t rows, int64_t columns) {
  const auto [r, c] = sides(rows, columns);
  return give(fill(corners, starts, origin, cell, r, c), {static_cast<size_t>(r), static_cast<size_t>(c)});
}

// [m] from the edge of what is filled inwards; beyond the raster nothing is.
inline Out<float> depths(In<double, 2> corners, In<int64_t, 1> starts, In<double, 1> origin, double cell, int64_t rows,
                         int64_t columns) {
  const auto [r, c] = sides(rows, columns);
  const std::vector<uint8_t> filled = fill(corners, starts, origin, cell, r, c);
  std::vector<float> padded(static_cast<size_t>(r + 2) * (c + 2));
  Distances(r + 2, c + 2).find(
      [&, r = r, c = c](int32_t i, int32_t j) {
        return i == 0 || j == 0 || i > r || j > c || !filled[static_cast<size_t>(i - 1) * c + (j - 1)];
      },
      [&](size_t at, size_t count, int64_t off, int64_t height, size_t) {
        measure(padded.data() + at, count, off, height, cell);
      });
  std::vector<float> depth(filled.size());
  for (int32_t i = 0; i < r; ++i)
    std::copy_n(padded.begin() + static_cast<size_t>(i + 1) * (c + 2) + 1, c,
                depth.begin() + static_cast<size_t>(i) * c);
  return give(std::move(depth), {static_cast<size_t>(r), static_cast<size_t>(c)});
}

// What each cell says: where the wall near it faces, that it was seen through, or nothing.
inline Out<uint8_t> cell_codes(In<int32_t, 2> nearest, In<float, 2> distance, In<float, 2> depth, In<uint8_t, 1> facing,
                               double closeness, double clearance, uint8_t nothing, uint8_t seen_through) {
  for (const auto& other : {distance, depth})
    if (other.shape(0) != nearest.shape(0) || other.shape(1) != nearest.shape(1))
      throw std::invalid_argument("nearest, distance and depth: of one shape expected");
  const float close = static_cast<float>(closeness), deep = static_cast<float>(clearance);
  std::vector<uint8_t> codes(nearest.size());
  for (size_t k = 0; k < codes.size(); ++k) {
    codes[k] = depth.data()[k] > deep ? seen_through : nothing;
    if (!(distance.data()[k] < close)) continue;
    const int64_t sample = nearest.data()[k];
    if (sample < 0 || sample >= static_cast<int64_t>(facing.shape(0)))
      throw std::invalid_argument("nearest: numbers of samples expected");
    codes[k] = facing(sample);
  }
  return give(std::move(codes), {nearest.shape(0), nearest.shape(1)});
}

}  // namespace rasters

inline void bind_rasters(nb::module_& m) {
  m.def("nearest_samples", &rasters::nearest_samples, nb::arg("points"), nb::arg("origin"), nb::arg("cell"),
        nb::arg("rows"), nb::arg("columns"));
  m.def("filled_cells", &rasters::filled_cells, nb::arg("corners"), nb::arg("starts"), nb::arg("origin"),
        nb::arg("cell"), nb::arg("rows"), nb::arg("columns"));
  m.def("cell_codes", &rasters::cell_codes, nb::arg("nearest"), nb::arg("distance"), nb::arg("depth"),
        nb::arg("facing"), nb::arg("closeness"), nb::arg("clearance"), nb::arg("nothing"), nb::arg("seen_through"));
  m.def("depths", &rasters::depths, nb::arg("corners"), nb::arg("starts"), nb::arg("origin"), nb::arg("cell"),
        nb::arg("rows"), nb::arg("columns"));
}
