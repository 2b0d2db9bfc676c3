// What maps put into cells, and how that is correlated. The twins and the words are in matching/marks.py.
#pragma once
#include <algorithm>
#include <numeric>
#include <utility>
#include <vector>

#include "arrays.hpp"

namespace marks {

// Adds values at places to cells: row by row complex numbers in single precision.
class Grid {
 public:
  Grid(In<double, 1> low, double cell, int64_t rows, int64_t columns)
      : cell_(cell), rows_(rows), columns_(columns) {
    if (low.shape(0) != 2 || !(cell > 0) || rows < 1 || columns < 1)
      throw std::invalid_argument("low (2,), cell > 0, rows and columns of 1 or more expected");
    x_ = low(0);
    y_ = low(1);
  }
  size_t size() const { return static_cast<size_t>(rows_ * columns_); }
  size_t at(const double* place) const {
    const double i = (place[0] - x_) / cell_, j = (place[1] - y_) / cell_;
    if (!(i > -1 && j > -1 && i < static_cast<double>(rows_) && j < static_cast<double>(columns_)))
      throw std::invalid_argument("places: inside of the grid expected");
    return static_cast<size_t>(static_cast<int64_t>(i) * columns_ + static_cast<int64_t>(j));
  }

 private:
  double x_ = 0, y_ = 0, cell_;
  int64_t rows_, columns_;
};

inline void check_places(In<double, 2> places, In<double, 2> normals) {
  if (places.shape(1) != 2 || normals.shape(1) != 2 || places.shape(0) != normals.shape(0))
    throw std::invalid_argument("places and normals: (n, 2) each expected");
}

// Three grids: the places, each times its normal, times that squared; and what a metre counts, `swapped` or not.
inline Out<float> mark_cells(In<double, 2> wall, In<double, 2> facing, In<double, 1> metres, In<double, 2> near,
                             In<double, 2> alike, In<double, 2> seen, In<double, 1> low, double cell, int64_t rows,
                             int64_t columns, double part, double weight, bool is_reference) {
  check_places(wall, facing);
  check_places(near, alike);
  if (metres.shape(0) != wall.shape(0) || seen.shape(1) != 2)
    throw std::invalid_argument("metres (n,), seen (k, 2) expected");
  const Grid grid(low, cell, rows, columns);
  const size_t size = grid.size();
  std::vector<float> sums(6 * size, 0.0f);
  float *one = sums.data(), *two = one + 2 * size, *three = two + 2 * size;
  float *worth = is_reference ? three : three + 1, *length = is_reference ? three + 1 : three;
  const auto add = [](float* sum, double value) { *sum += static_cast<float>(value); };
  for (size_t k = 0; k < wall.shape(0); ++k) {
    const size_t at = 2 * grid.at(wall.data() + 2 * k);
    const double u = facing(k, 0), v = facing(k, 1), m = metres(k);
    add(length + at, m);
    if (is_reference) continue;
    add(one + at, u * m);
    add(one + at + 1, v * m);
    add(two + at, (u * u - v * v) * m);
    add(two + at + 1, 2 * u * v * m);
  }
  for (size_t k = 0; k < near.shape(0); ++k) {
    const size_t at = 2 * grid.at(near.data() + 2 * k);
    const double u = alike(k, 0), v = alike(k, 1);
    add(worth + at, 0.125 * part);
    if (!is_reference) continue;
    add(one + at, u * (part / 2));
    add(one + at + 1, v * (part / 2));
    add(two + at, (u * u - v * v) * (part / 4));
    add(two + at + 1, 2 * u * v * (part / 4));
  }
  for (size_t k = 0; k < seen.shape(0); ++k) add(worth + 2 * grid.at(seen.data() + 2 * k), -(weight * part));
  return give(std::move(sums), {3, static_cast<size_t>(rows), static_cast<size_t>(columns), 2});
}

// The sum of the products of grids (g, rows, columns, 2) of complex numbers with conjugates of others.
inline Out<float> conjugate_products(In<float, 4> here, In<float, 4> there) {
  for (int d = 0; d < 4; ++d)
    if (here.shape(d) != there.shape(d) || here.shape(3) != 2)
      throw std::invalid_argument("grids (g, rows, columns, 2) of one shape expected");
  const size_t size = here.shape(1) * here.shape(2);
  std::vector<float> sums(2 * size, 0.0f);
  for (size_t g = 0; g < here.shape(0); ++g) {
    const float *a = here.data() + 2 * size * g, *b = there.data() + 2 * size * g;
    for (size_t k = 0; k < 2 * size; k += 2) {
      sums[k] += a[k] * b[k] + a[k + 1] * b[k + 1];
      sums[k + 1] += a[k + 1] * b[k] - a[k] * b[k + 1];
    }
  }
  return give(std::move(sums), {here.shape(1), here.shape(2), 2});
}

// Numbers of the `count` highest real parts of (n, 2) complex numbers, the highest first; of equals the lower one.
inline Out<int64_t> highest(In<float, 2> values, int64_t count) {
  if (values.shape(1) != 2 || count < 0) throw std::invalid_argument("values (n, 2), count >= 0 expected");
  const size_t kept = std::min(values.shape(0), static_cast<size_t>(count));
  const auto better = [&](int64_t a, int64_t b) {
    return values(a, 0) != values(b, 0) ? values(a, 0) > values(b, 0) : a < b;
  };
  std::vector<int64_t> best(kept);  // a heap with the worst of them at its top
  std::iota(best.begin(), best.end(), 0);
  std::make_heap(best.begin(), best.end(), better);
  for (size_t k = kept; k < values.shape(0) && kept > 0; ++k) {
    if (!(values(k, 0) > values(best.front(), 0))) continue;
    std::pop_heap(best.begin(), best.end(), better);
    best.back() = static_cast<int64_t>(k);
    std::push_heap(best.begin(), best.end(), better);
  }
  std::sort(best.begin(), best.end(), better);
  return give(std::move(best), {kept});
}

}  // namespace marks

inline void bind_marks(nb::module_& m) {
  m.def("mark_cells", &marks::mark_cells, nb::arg("wall"), nb::arg("facing"), nb::arg("metres"), nb::arg("near"),
        nb::arg("alike"), nb::arg("seen"), nb::arg("low"), nb::arg("cell"), nb::arg("rows"), nb::arg("columns"),
        nb::arg("part"), nb::arg("weight"), nb::arg("is_reference"));
  m.def("conjugate_products", &marks::conjugate_products, nb::arg("here"), nb::arg("there"));
  m.def("highest", &marks::highest, nb::arg("values"), nb::arg("count"));
}
