// The parts that cells fall into, and the part nearest to each cell. The twin and the words are in matching/parts.py.
#pragma once
#include <algorithm>
#include <vector>

#include "arrays.hpp"
#include "rasters.hpp"

namespace parts {

// Numbers cells that touch, corners included, from 1 on, in the order of their first cells; the others stay 0.
inline int64_t number(const bool* chosen, int64_t rows, int64_t columns, std::vector<int64_t>& label) {
  int64_t count = 0;
  std::vector<int64_t> open;
  for (int64_t start = 0; start < rows * columns; ++start) {
    if (!chosen[start] || label[start]) continue;
    label[start] = ++count;
    open.assign(1, start);
    while (!open.empty()) {
      const int64_t i = open.back() / columns, j = open.back() % columns;
      open.pop_back();
      for (int64_t r = std::max<int64_t>(i - 1, 0); r <= std::min(i + 1, rows - 1); ++r)
        for (int64_t c = std::max<int64_t>(j - 1, 0); c <= std::min(j + 1, columns - 1); ++c)
          if (const int64_t cell = r * columns + c; chosen[cell] && !label[cell]) {
            label[cell] = count;
            open.push_back(cell);
          }
    }
  }
  return count;
}

inline std::pair<Out<int64_t>, Out<int64_t>> nearest_parts(In<bool, 2> chosen) {
  const auto [r, c] = rasters::sides(static_cast<int64_t>(chosen.shape(0)), static_cast<int64_t>(chosen.shape(1)));
  const size_t size = static_cast<size_t>(r) * c;
  std::vector<int64_t> label(size, 0), nearest(size, 0);
  if (number(chosen.data(), r, c, label) > 0) {
    std::vector<uint8_t> seeds(size);
    for (size_t k = 0; k < size; ++k) seeds[k] = label[k] > 0;
    rasters::Distances(r, c).find(
        seeds.data(),
        [&](size_t at, size_t count, size_t seed) {
          std::fill_n(nearest.begin() + static_cast<int64_t>(at), count, label[seed]);
        },
        [](int32_t, const double*) {});
  }
  const std::initializer_list<size_t> shape = {static_cast<size_t>(r), static_cast<size_t>(c)};
  return {give(std::move(label), shape), give(std::move(nearest), shape)};
}

}  // namespace parts

inline void bind_parts(nb::module_& m) { m.def("nearest_parts", &parts::nearest_parts, nb::arg("chosen")); }
