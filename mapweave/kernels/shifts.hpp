// Every shift of a map over another, in wide cells. The twin and the words are in matching/shifts.py.
#pragma once
#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "arrays.hpp"
#include "place_views.hpp"

// Where the machine has wider registers they are used: the same sums, for nothing is fused.
#if defined(__GNUC__) && !defined(__clang__) && defined(__x86_64__) && defined(__GLIBC__)
#define MAPWEAVE_WIDE __attribute__((target_clones("avx2", "default")))
#else
#define MAPWEAVE_WIDE
#endif

namespace shifts {

constexpr int kFacings = 8;   // in wide cells: 45° each
constexpr double kCentimetre = 0.01;

// Adds the used parts of rows to those of sums, times `metres`. Whole numbers, small enough for exact sums in single
// precision: no order of adding tells.
MAPWEAVE_WIDE inline void add_rows(float* __restrict sums, int64_t stride, const float* __restrict worth,
                                   int64_t columns, const std::pair<int64_t, int64_t>* used, int64_t rows,
                                   float metres) {
  for (int64_t i = 0; i < rows; ++i) {
    float* sum = sums + i * stride;
    const float* row = worth + i * columns;
    for (int64_t k = used[i].first; k < used[i].second; ++k) sum[k] += metres * row[k];
  }
}

struct Wall {
  int64_t row, column;
  int facing;
  float metres;  // [cm], whole
};

// A map at one turn, in wide cells: what a metre of wall counts in each, by the way it faces, from the far corner on
// where it is `reversed`; and its walls.
class WideMap {
 public:
  WideMap(const place_views::PlaceView& view, double turn, double width, int64_t directions, float weight,
          bool reversed)
      : cosine_(std::cos(turn)), sine_(std::sin(turn)), turns_(turn / 6.283185307179586476925286766559 + 2),
        width_(width), reversed_(reversed) {
    frame(view);
    count_cells(view, directions, weight);
    collect_walls(view);
    bound_rows();
  }

  double x() const { return x_; }
  double y() const { return y_; }
  int64_t rows() const { return rows_; }
  int64_t columns() const { return columns_; }
  const std::vector<Wall>& walls() const { return walls_; }
  const float* worth(int facing) const { return worth_.data() + facing * rows_ * columns_; }
  // From where to where each row says anything.
  const std::pair<int64_t, int64_t>* used(int facing) const { return used_.data() + facing * rows_; }

 private:
  void frame(const place_views::PlaceView& view) {
    double high[2] = {-1e300, -1e300}, low[2] = {1e300, 1e300};
    for (int corner = 0; corner < 4; ++corner) {
      const auto [x, y] = turned(view.centre(corner & 1 ? view.rows() : -1, corner & 2 ? view.columns() : -1));
      low[0] = std::min(low[0], x), low[1] = std::min(low[1], y);
      high[0] = std::max(high[0], x), high[1] = std::max(high[1], y);
    }
    x_ = low[0], y_ = low[1];
    rows_ = static_cast<int64_t>((high[0] - x_) / width_) + 1;
    columns_ = static_cast<int64_t>((high[1] - y_) / width_) + 1;
    if (rows_ > 4096 || columns_ > 4096) throw std::invalid_argument("width: 4096 cells a side at the most expected");
  }

  std::pair<double, double> turned(std::pair<double, double> place) const {
    return {cosine_ * place.first - sine_ * place.second, sine_ * place.first + cosine_ * place.second};
  }

  size_t at(std::pair<double, double> place) const {
    const auto [x, y] = turned(place);
    return static_cast<size_t>(static_cast<int64_t>((x - x_) / width_) * columns_ +
                               static_cast<int64_t>((y - y_) / width_));
  }

  int facing(double turn) const {
    return static_cast<int>(static_cast<int64_t>((turn + turns_) * kFacings + 0.5)) & (kFacings - 1);
  }

  // Wall counts 2 for each cell near a wall that faces as it does, 1 where that is the next facing; every second row
  // and column.
  void count_cells(const place_views::PlaceView& view, int64_t directions, float weight) {
    const size_t size = static_cast<size_t>(rows_ * columns_);
    std::vector<float> seen(size, 0.0f);
    worth_.assign(kFacings * size, 0.0f);
    std::vector<int> facings(directions);
    for (int64_t d = 0; d < directions; ++d)
      facings[d] = facing((static_cast<double>(d) + 0.5) / static_cast<double>(directions));
    for (int64_t i = 0; i < view.rows(); i += 2)
      for (int64_t j = 0; j < view.columns(); j += 2) {
        const int64_t code = view.code(i, j);
        if (code == directions) continue;
        const size_t place = at(view.centre(i, j)), cell = reversed_ ? size - 1 - place : place;
        if (code > directions) {
          seen[cell] -= 2 * weight;
          continue;
        }
        const int f = facings[code];
        worth_[f * size + cell] += 2;
        worth_[((f + 1) & (kFacings - 1)) * size + cell] += 1;
        worth_[((f + kFacings - 1) & (kFacings - 1)) * size + cell] += 1;
      }
    for (int f = 0; f < kFacings; ++f)
      for (size_t k = 0; k < size; ++k) worth_[f * size + k] += seen[k];
  }

  void collect_walls(const place_views::PlaceView& view) {
    const size_t size = static_cast<size_t>(rows_ * columns_);
    std::vector<double> metres(kFacings * size, 0.0);
    std::vector<size_t> found;
    for (size_t k = 0; k < view.samples(); ++k) {
      const double* p = view.sample(k);
      if (!view.holds(p[0], p[1])) throw std::invalid_argument("samples: inside of the raster expected");
      const size_t cell = facing(p[2]) * size + at({p[0], p[1]});
      if (metres[cell] == 0 && p[3] > 0) found.push_back(cell);
      metres[cell] += p[3];
    }
    for (const size_t cell : found) {
      const int64_t place = static_cast<int64_t>(cell % size);
      walls_.push_back({place / columns_, place % columns_, static_cast<int>(cell / size),
                        static_cast<float>(std::nearbyint(metres[cell] / kCentimetre))});
    }
  }

  void bound_rows() {
    used_.assign(static_cast<size_t>(kFacings * rows_), {0, 0});
    for (int f = 0; f < kFacings; ++f)
      for (int64_t i = 0; i < rows_; ++i) {
        const float* row = worth(f) + i * columns_;
        int64_t first = 0, last = columns_;
        while (first < last && row[first] == 0) ++first;
        while (last > first && row[last - 1] == 0) --last;
        used_[f * rows_ + i] = {first, last};
      }
  }

  double cosine_, sine_, turns_, width_, x_ = 0, y_ = 0;
  bool reversed_;
  int64_t rows_ = 0, columns_ = 0;
  std::vector<float> worth_;
  std::vector<Wall> walls_;
  std::vector<std::pair<int64_t, int64_t>> used_;
};

// What every shift of a map over another counts, which is reversed.
class Sums {
 public:
  Sums(const WideMap& reference, const WideMap& other)
      : rows_(reference.rows() + other.rows() - 1), columns_(reference.columns() + other.columns() - 1),
        sum_(static_cast<size_t>(rows_ * columns_), 0.0f) {
    for (const Wall& w : other.walls())
      add(reference, w, other.rows() - 1 - w.row, other.columns() - 1 - w.column);
    for (const Wall& w : reference.walls()) add(other, w, w.row, w.column);
  }

  int64_t columns() const { return columns_; }
  double at(int64_t place) const { return static_cast<double>(sum_[place]); }

  // Of the places that are above 0 and no lower than the eight about them the `count` highest, of equals the first.
  std::vector<int64_t> peaks(int64_t count) const {
    const auto better = [&](int64_t a, int64_t b) { return sum_[a] != sum_[b] ? sum_[a] > sum_[b] : a < b; };
    std::vector<int64_t> best;  // a heap with the worst of them at its top
    float least = 0;
    for (int64_t i = 0; i < rows_ && count > 0; ++i)
      for (int64_t j = 0; j < columns_; ++j) {
        const int64_t place = i * columns_ + j;
        if (!(sum_[place] > least) || !is_peak(i, j)) continue;
        if (static_cast<int64_t>(best.size()) == count) {
          std::pop_heap(best.begin(), best.end(), better);
          best.pop_back();
        }
        best.push_back(place);
        std::push_heap(best.begin(), best.end(), better);
        if (static_cast<int64_t>(best.size()) == count) least = sum_[best.front()];
      }
    std::sort(best.begin(), best.end(), better);
    return best;
  }

  // Where between the cells the peak is, along rows and columns: the top of a parabola.
  std::pair<double, double> top(int64_t place) const {
    const int64_t i = place / columns_, j = place % columns_;
    const double down = i > 0 && i + 1 < rows_ ? between(place - columns_, place, place + columns_) : 0;
    const double right = j > 0 && j + 1 < columns_ ? between(place - 1, place, place + 1) : 0;
    return {static_cast<double>(i) + down, static_cast<double>(j) + right};
  }

 private:
  void add(const WideMap& map, const Wall& wall, int64_t down, int64_t right) {
    add_rows(sum_.data() + down * columns_ + right, columns_, map.worth(wall.facing), map.columns(),
             map.used(wall.facing), map.rows(), wall.metres);
  }

  bool is_peak(int64_t i, int64_t j) const {
    const float here = sum_[i * columns_ + j];
    for (int64_t r = std::max<int64_t>(i - 1, 0); r <= std::min(i + 1, rows_ - 1); ++r)
      for (int64_t c = std::max<int64_t>(j - 1, 0); c <= std::min(j + 1, columns_ - 1); ++c)
        if (sum_[r * columns_ + c] > here) return false;
    return true;
  }

  double between(int64_t before, int64_t here, int64_t after) const {
    const double bend = at(before) - 2 * at(here) + at(after);
    return bend < 0 ? (at(before) - at(after)) / (2 * bend) : 0;
  }

  int64_t rows_, columns_;
  std::vector<float> sum_;
};

inline std::pair<Out<double>, Out<double>> best_shifts(const place_views::PlaceView& reference,
                                                       const place_views::PlaceView& other, In<double, 1> turns,
                                                       double width, int64_t directions, int64_t weight,
                                                       int64_t count) {
  if (!(width > 1e-3) || directions < 1 || directions > 254 || weight < 0 || weight > 100 || count < 0)
    throw std::invalid_argument("width > 0, 1 to 254 directions, weight of 0 to 100, count >= 0 expected");
  std::vector<double> found, scores;
  const WideMap here(reference, 0.0, width, directions, static_cast<float>(weight), false);
  // Of the cells looked at so many lie in a wide one; both ways are added up, and each counts 2.
  const double cells = width * width / (4 * reference.cell() * other.cell()), unit = kCentimetre / (4 * cells);
  for (size_t t = 0; t < turns.shape(0); ++t) {
    if (!(std::abs(turns(t)) < 7)) throw std::invalid_argument("turns: angles within a turn expected");
    const WideMap there(other, turns(t), width, directions, static_cast<float>(weight), true);
    const Sums sums(here, there);
    for (const int64_t place : sums.peaks(count)) {
      const auto [i, j] = sums.top(place);
      found.insert(found.end(), {here.x() - there.x() + width * (i - static_cast<double>(there.rows() - 1)),
                                 here.y() - there.y() + width * (j - static_cast<double>(there.columns() - 1)),
                                 turns(t)});
      scores.push_back(sums.at(place) * unit);
    }
  }
  const size_t n = scores.size();
  return {give(std::move(found), {n, 3}), give(std::move(scores), {n})};
}

}  // namespace shifts

inline void bind_shifts(nb::module_& m) {
  m.def("best_shifts", &shifts::best_shifts, nb::arg("reference"), nb::arg("other"), nb::arg("turns"),
        nb::arg("width"), nb::arg("directions"), nb::arg("weight"), nb::arg("count"));
}
