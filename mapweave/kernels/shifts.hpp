// Every shift of a map over another, in wide cells. The twin and the words are in matching/shifts.py.
#pragma once
#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "arrays.hpp"
#include "place_views.hpp"

namespace shifts {

constexpr int kFacings = 8;   // in wide cells: 45° each
constexpr double kCentimetre = 0.01;

constexpr int64_t kAtOnce = 8;  // cells added: rows go on with as many that say nothing, and so do all sums

// Adds the used parts of rows to those of sums, times `metres`. Whole numbers, small enough for exact sums in single
// precision: no order of adding tells.
MAPWEAVE_WIDE inline void add_rows(float* __restrict sums, int64_t stride, const float* __restrict worth,
                                   int64_t columns, const std::pair<int64_t, int64_t>* used, int64_t rows,
                                   float metres) {
  for (int64_t i = 0; i < rows; ++i)
    for (int64_t k = used[i].first; k < used[i].second; k += kAtOnce) {
      float* sum = sums + i * stride + k;
      const float* row = worth + i * columns + k;
      for (int64_t u = 0; u < kAtOnce; ++u) sum[u] += metres * row[u];
    }
}

MAPWEAVE_WIDE inline void add_up(float* __restrict sums, const float* __restrict twice, const float* __restrict once,
                                 const float* __restrict other, const float* __restrict seen, size_t count) {
  for (size_t k = 0; k < count; ++k) sums[k] = 2 * twice[k] + once[k] + other[k] + seen[k];
}

struct Wall {
  int64_t row, column;
  int facing;
  float metres;  // [cm], whole
};

// Memory that is kept from one turn to the next, and from call to call: to ask for it anew takes longer than to fill it.
struct Memory {
  std::vector<float> near, seen, worth[2], sums;
  std::vector<double> metres;  // all 0 between two maps

  // Lets go of it where it was much.
  void release() {
    constexpr size_t kKept = size_t{1} << 20;
    if (near.capacity() + metres.capacity() + sums.capacity() > kKept) *this = Memory();
  }
};

// A map at one turn, in wide cells: what a metre of wall counts in each, by the way it faces, from the far corner on
// where it is `reversed`; and its walls.
class WideMap {
 public:
  WideMap(const place_views::PlaceView& view, double turn, double width, int64_t directions, float weight,
          bool reversed, Memory& memory)
      : cosine_(std::cos(turn)), sine_(std::sin(turn)), turns_(turn / 6.283185307179586476925286766559 + 2),
        width_(width), reversed_(reversed), worth_(memory.worth[reversed]) {
    check(view);
    frame(view);
    count_cells(view, directions, weight, memory);
    collect_walls(view, memory.metres);
  }

  double x() const { return x_; }
  double y() const { return y_; }
  int64_t rows() const { return rows_; }
  int64_t columns() const { return columns_; }
  const std::vector<Wall>& walls() const { return walls_; }
  // Rows are `stride` apart: after the last column nothing is said.
  const float* worth(int facing) const { return worth_.data() + facing * rows_ * stride(); }
  int64_t stride() const { return columns_ + kAtOnce; }
  // From where to where each row says anything.
  const std::pair<int64_t, int64_t>* used() const { return used_.data(); }

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

  std::pair<int64_t, int64_t> cell(std::pair<double, double> place) const {
    const auto [x, y] = turned(place);
    return {static_cast<int64_t>((x - x_) / width_), static_cast<int64_t>((y - y_) / width_)};
  }

  int facing(double turn) const {
    return static_cast<int>(static_cast<int64_t>((turn + turns_) * kFacings + 0.5)) & (kFacings - 1);
  }

  // Wall counts 2 for each cell near a wall that faces as it does, 1 where that is the next facing; every second row
  // and column.
  void count_cells(const place_views::PlaceView& view, int64_t directions, float weight, Memory& memory) {
    const size_t size = static_cast<size_t>(rows_ * stride());
    memory.near.assign(kFacings * size, 0.0f);
    memory.seen.assign(size, 0.0f);
    used_.assign(static_cast<size_t>(rows_), {columns_, 0});
    std::vector<int> facings(directions);
    for (int64_t d = 0; d < directions; ++d)
      facings[d] = facing((static_cast<double>(d) + 0.5) / static_cast<double>(directions));
    for (int64_t i = 0; i < view.rows(); i += 2)
      for (int64_t j = 0; j < view.columns(); j += 2) {
        const int64_t code = view.code(i, j);
        if (code == directions) continue;
        const auto [row, column] = cell(view.centre(i, j));
        const int64_t i_there = reversed_ ? rows_ - 1 - row : row, j_there = reversed_ ? columns_ - 1 - column : column;
        const size_t place = static_cast<size_t>(i_there * stride() + j_there);
        auto& [first, last] = used_[i_there];
        first = std::min(first, j_there), last = std::max(last, j_there + 1);
        if (code > directions)
          memory.seen[place] -= 2 * weight;
        else
          memory.near[facings[code] * size + place] += 1;
      }
    worth_.resize(kFacings * size);
    const auto near = [&](int f) { return memory.near.data() + (f & (kFacings - 1)) * size; };
    for (int f = 0; f < kFacings; ++f)
      add_up(worth_.data() + f * size, near(f), near(f + 1), near(f - 1), memory.seen.data(), size);
  }

  void check(const place_views::PlaceView& view) const {
    for (size_t k = 0; k < view.samples(); ++k)
      if (!view.holds(view.sample(k)[0], view.sample(k)[1]))
        throw std::invalid_argument("samples: inside of the raster expected");
  }

  void collect_walls(const place_views::PlaceView& view, std::vector<double>& metres) {
    const size_t size = static_cast<size_t>(rows_ * columns_);
    if (metres.size() < kFacings * size) metres.resize(kFacings * size, 0.0);
    std::vector<size_t> found;
    for (size_t k = 0; k < view.samples(); ++k) {
      const double* p = view.sample(k);
      const auto [row, column] = cell({p[0], p[1]});
      const size_t place = facing(p[2]) * size + static_cast<size_t>(row * columns_ + column);
      if (metres[place] == 0 && p[3] > 0) found.push_back(place);
      metres[place] += p[3];
    }
    for (const size_t place : found) {
      const int64_t in_plane = static_cast<int64_t>(place % size);
      walls_.push_back({in_plane / columns_, in_plane % columns_, static_cast<int>(place / size),
                        static_cast<float>(std::nearbyint(metres[place] / kCentimetre))});
      metres[place] = 0;
    }
  }

  double cosine_, sine_, turns_, width_, x_ = 0, y_ = 0;
  bool reversed_;
  int64_t rows_ = 0, columns_ = 0;
  std::vector<float>& worth_;
  std::vector<Wall> walls_;
  std::vector<std::pair<int64_t, int64_t>> used_;
};

// What every shift of a map over another counts, which is reversed.
class Sums {
 public:
  Sums(const WideMap& reference, const WideMap& other, Memory& memory)
      : rows_(reference.rows() + other.rows() - 1), columns_(reference.columns() + other.columns() - 1),
        sum_(memory.sums) {
    sum_.assign(static_cast<size_t>(rows_ * columns_ + kAtOnce), 0.0f);
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
    add_rows(sum_.data() + down * columns_ + right, columns_, map.worth(wall.facing), map.stride(),
             map.used(), map.rows(), wall.metres);
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
  std::vector<float>& sum_;
};

inline std::pair<Out<double>, Out<double>> best_shifts(const place_views::PlaceView& reference,
                                                       const place_views::PlaceView& other, In<double, 1> turns,
                                                       double width, int64_t directions, int64_t weight,
                                                       int64_t count) {
  if (!(width > 1e-3) || directions < 1 || directions > 254 || weight < 0 || weight > 100 || count < 0)
    throw std::invalid_argument("width > 0, 1 to 254 directions, weight of 0 to 100, count >= 0 expected");
  std::vector<double> found, scores;
  static thread_local Memory memory;
  const WideMap here(reference, 0.0, width, directions, static_cast<float>(weight), false, memory);
  // Of the cells looked at so many lie in a wide one; both ways are added up, and each counts 2.
  const double cells = width * width / (4 * reference.cell() * other.cell()), unit = kCentimetre / (4 * cells);
  for (size_t t = 0; t < turns.shape(0); ++t) {
    if (!(std::abs(turns(t)) < 7)) throw std::invalid_argument("turns: angles within a turn expected");
    const WideMap there(other, turns(t), width, directions, static_cast<float>(weight), true, memory);
    const Sums sums(here, there, memory);
    for (const int64_t place : sums.peaks(count)) {
      const auto [i, j] = sums.top(place);
      found.insert(found.end(), {here.x() - there.x() + width * (i - static_cast<double>(there.rows() - 1)),
                                 here.y() - there.y() + width * (j - static_cast<double>(there.columns() - 1)),
                                 turns(t)});
      scores.push_back(sums.at(place) * unit);
    }
  }
  memory.release();
  const size_t n = scores.size();
  return {give(std::move(found), {n, 3}), give(std::move(scores), {n})};
}

}  // namespace shifts

inline void bind_shifts(nb::module_& m) {
  m.def("best_shifts", &shifts::best_shifts, nb::arg("reference"), nb::arg("other"), nb::arg("turns"),
        nb::arg("width"), nb::arg("directions"), nb::arg("weight"), nb::arg("count"));
}
