// What maps say of transforms between them, by few samples and coarse cells: cheap enough for hundreds of
// candidates. The twin and the words are in matching/place_views.py.
#pragma once
#include <cmath>
#include <utility>
#include <vector>

#include "arrays.hpp"

namespace place_views {

constexpr size_t kAhead = 4;  // places before one that what it reads is fetched

class PlaceView {
 public:
  // codes (rows, columns): what a cell says. samples (n, 4): x, y, direction in turns, metres of wall.
  PlaceView(In<uint8_t, 2> codes, In<double, 1> origin, double cell, In<double, 2> samples)
      : rows_(codes.shape(0)),
        columns_(codes.shape(1)),
        codes_(codes.data(), codes.data() + rows_ * columns_),
        cell_(cell),
        samples_(samples.data(), samples.data() + samples.shape(0) * samples.shape(1)) {
    if (origin.shape(0) != 2 || samples.shape(1) != 4 || !(cell > 1e-3))
      throw std::invalid_argument("origin (2,), samples (n, 4), cell above 0 expected");
    origin_[0] = origin(0), origin_[1] = origin(1);
  }

  // What the walls of `other`, every `stride`th sample, count in this map, at the pose x, y, theta of it.
  double worth(const PlaceView& other, double x, double y, double theta, size_t stride, const double* table,
               size_t said, size_t directions) const {
    const double turn = theta / 6.283185307179586476925286766559 + 2;
    double sum = 0;
    each_cell(other, x, y, theta, stride, [&](const double* p, const uint8_t& cell) {
      const size_t code = cell;
      size_t facing = static_cast<size_t>((p[2] + turn) * static_cast<double>(directions));
      while (facing >= directions) facing -= directions;  // thrice at most: sooner done than a division
      if (code < said) sum += p[3] * table[code * directions + facing];
    });
    return sum;
  }

  // Fetches what will be read here for `worth`: of thousands of maps, most are far away.
  void fetch(const PlaceView& other, double x, double y, double theta, size_t stride) const {
    for (size_t k = 0; k < samples_.size(); k += 4 * stride) __builtin_prefetch(samples_.data() + k);
    each_cell(other, x, y, theta, stride, [](const double*, const uint8_t& cell) { __builtin_prefetch(&cell); });
  }

  int64_t rows() const { return static_cast<int64_t>(rows_); }
  int64_t columns() const { return static_cast<int64_t>(columns_); }
  double cell() const { return cell_; }
  uint8_t code(int64_t row, int64_t column) const { return codes_[row * columns() + column]; }
  // [m], of a cell, which need not be there.
  std::pair<double, double> centre(int64_t row, int64_t column) const {
    return {origin_[0] + (static_cast<double>(row) + 0.5) * cell_,
            origin_[1] + (static_cast<double>(column) + 0.5) * cell_};
  }
  bool holds(double x, double y) const {
    const double row = (x - origin_[0]) / cell_, column = (y - origin_[1]) / cell_;
    return row >= 0 && column >= 0 && row <= static_cast<double>(rows_) && column <= static_cast<double>(columns_);
  }
  size_t samples() const { return samples_.size() / 4; }
  const double* sample(size_t k) const { return samples_.data() + 4 * k; }

 private:
  // Calls `seen` with every `stride`th sample of `other` that lies in this map, and the cell that it lies in.
  template <typename Seen>
  void each_cell(const PlaceView& other, double x, double y, double theta, size_t stride, Seen seen) const {
    const double c = std::cos(theta), s = std::sin(theta);
    const double rows = static_cast<double>(rows_), columns = static_cast<double>(columns_);
    for (size_t k = 0; k < other.samples_.size(); k += 4 * stride) {
      const double* p = other.samples_.data() + k;
      const double row = (c * p[0] - s * p[1] + x - origin_[0]) / cell_;
      const double column = (s * p[0] + c * p[1] + y - origin_[1]) / cell_;
      if (!(row >= 0 && column >= 0 && row < rows && column < columns)) continue;
      seen(p, codes_[static_cast<size_t>(row) * columns_ + static_cast<size_t>(column)]);
    }
  }

  size_t rows_, columns_;
  std::vector<uint8_t> codes_;
  double origin_[2], cell_;
  std::vector<double> samples_;
};

// (n,) what each of `views` and `other` say of the pose of `other` in it, the mean of both, by every `stride`th
// sample.
inline Out<double> score_views(const PlaceView& other, const std::vector<const PlaceView*>& views,
                               In<double, 2> transforms, In<double, 2> table, int64_t stride) {
  if (transforms.shape(0) != views.size() || transforms.shape(1) != 3 || table.shape(1) == 0 || stride < 1)
    throw std::invalid_argument("transforms (n, 3) of n views, table (codes, directions), stride >= 1 expected");
  for (size_t k = 0; k < views.size(); ++k)
    if (!(std::isfinite(transforms(k, 0)) && std::isfinite(transforms(k, 1)) && std::abs(transforms(k, 2)) < 7))
      throw std::invalid_argument("transforms: finite numbers, angles within a turn expected");
  std::vector<double> scores(views.size());
  for (size_t k = 0; k < views.size(); ++k) {
    const double x = transforms(k, 0), y = transforms(k, 1), theta = transforms(k, 2);
    if (const size_t n = k + kAhead; n < views.size())
      views[n]->fetch(other, transforms(n, 0), transforms(n, 1), transforms(n, 2), static_cast<size_t>(stride));
    const double c = std::cos(theta), s = std::sin(theta);
    const auto worth = [&](const PlaceView& in, const PlaceView& of, double px, double py, double turn) {
      return in.worth(of, px, py, turn, static_cast<size_t>(stride), table.data(), table.shape(0), table.shape(1));
    };
    const double there = worth(*views[k], other, x, y, theta);
    const double back = worth(other, *views[k], -c * x - s * y, s * x - c * y, -theta);
    scores[k] = static_cast<double>(stride) * (there + back) / 2;
  }
  const size_t n = scores.size();
  return give(std::move(scores), {n});
}

}  // namespace place_views

inline void bind_place_views(nb::module_& m) {
  using namespace place_views;
  nb::class_<PlaceView>(m, "PlaceView")
      .def(nb::init<In<uint8_t, 2>, In<double, 1>, double, In<double, 2>>(), nb::arg("codes"), nb::arg("origin"),
           nb::arg("cell"), nb::arg("samples"));
  m.def("score_views", &score_views, nb::arg("other"), nb::arg("views"), nb::arg("transforms"), nb::arg("table"),
        nb::arg("stride"));
}
