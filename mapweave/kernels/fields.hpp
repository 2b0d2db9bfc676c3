// A line map, sampled and rasterised. The twin and the words are in matching/fields.py.
#pragma once
#include <algorithm>
#include <cmath>
#include <tuple>
#include <vector>

#include "arrays.hpp"
#include "density.hpp"
#include "motions.hpp"
#include "rasters.hpp"
#include "sampling.hpp"

namespace fields {

using Rasterised = std::tuple<Out<double>, Out<double>, Out<int64_t>, Out<double>, Out<double>, Out<float>, Out<double>,
                              double, Out<int32_t>, Out<float>, Out<float>>;

// What wall is drawn again, within `same_wall`, counts once.
inline std::vector<double> weights_of(const sampling::LineSamples& samples, In<int64_t, 1> support, int64_t full_support,
                                      double same_wall, double min_cosine) {
  std::vector<double> weight = samples.metres;
  for (size_t k = 0; k < weight.size(); ++k)
    weight[k] *= std::min(1.0, static_cast<double>(support(samples.owner[k])) / static_cast<double>(full_support));
  if (!(same_wall > 0)) return weight;
  const auto times = density::times_drawn(samples.points, samples.normals, samples.metres, same_wall, min_cosine);
  for (size_t k = 0; k < weight.size(); ++k) weight[k] /= times[k];
  return weight;
}

// The cells that hold all samples, and a border around them.
inline rasters::Frame frame_around(const std::vector<double>& points, double border, double cell, double max_cells) {
  double low[2] = {points[0], points[1]}, high[2] = {points[0], points[1]};
  for (size_t k = 2; k < points.size(); ++k)
    low[k % 2] = std::min(low[k % 2], points[k]), high[k % 2] = std::max(high[k % 2], points[k]);
  for (int d = 0; d < 2; ++d) low[d] -= border, high[d] += border;
  const double wide = high[0] - low[0], tall = high[1] - low[1];
  cell = std::max(cell, std::sqrt(wide * tall / max_cells));
  const double most = 1e9;
  const auto [rows, columns] = rasters::sides(static_cast<int64_t>(std::min(std::ceil(wide / cell) + 1, most)),
                                              static_cast<int64_t>(std::min(std::ceil(tall / cell) + 1, most)));
  return {low[0], low[1], cell, rows, columns};
}

// Where the samples of each line face, in [0, 1) turns.
inline std::vector<double> facing_of(const sampling::LineSamples& samples) {
  std::vector<double> facing(samples.owner.size());
  for (size_t k = 0; k < facing.size(); ++k) {
    if (k > 0 && samples.owner[k] == samples.owner[k - 1]) {
      facing[k] = facing[k - 1];
      continue;
    }
    const double turns = std::atan2(samples.normals[2 * k + 1], samples.normals[2 * k]) / motions::kTurn;
    facing[k] = turns - std::floor(turns);
  }
  return facing;
}

inline Rasterised rasterised(In<double, 2> segments, In<int64_t, 1> support, const rasters::Rings& free_space,
                             double spacing, int64_t full_support, double same_wall, double min_cosine, double border,
                             double cell, double max_cells) {
  if (segments.shape(0) < 1 || support.shape(0) != segments.shape(0) || !(cell > 0 && border > 0 && max_cells >= 1))
    throw std::invalid_argument("segments, one at least, as many numbers, cell, border and max_cells > 0 expected");
  sampling::LineSamples samples = sampling::samples_of(segments, spacing);
  std::vector<double> weight = weights_of(samples, support, full_support, same_wall, min_cosine);
  std::vector<double> facing = facing_of(samples);
  const rasters::Frame frame = frame_around(samples.points, border, cell, max_cells);
  auto [nearest, distance] = rasters::nearest_samples(samples.points, frame);
  std::vector<float> depth = rasters::depths(free_space, frame);
  const size_t n = weight.size();
  std::vector<float> own_depth(n);
  for (size_t k = 0; k < n; ++k) {
    const size_t i = static_cast<size_t>((samples.points[2 * k] - frame.x) / frame.cell);
    own_depth[k] = depth[i * frame.columns + static_cast<size_t>((samples.points[2 * k + 1] - frame.y) / frame.cell)];
  }
  const std::initializer_list<size_t> shape = {static_cast<size_t>(frame.rows), static_cast<size_t>(frame.columns)};
  return {give(std::move(samples.points), {n, 2}), give(std::move(samples.normals), {n, 2}),
          give(std::move(samples.owner), {n}),     give(std::move(weight), {n}),
          give(std::move(facing), {n}),            give(std::move(own_depth), {n}),
          give(std::vector<double>{frame.x, frame.y}, {2}), frame.cell,
          give(std::move(nearest), shape),         give(std::move(distance), shape),
          give(std::move(depth), shape)};
}

}  // namespace fields

inline void bind_fields(nb::module_& m) {
  m.def("rasterised", &fields::rasterised, nb::arg("segments"), nb::arg("support"), nb::arg("free_space"),
        nb::arg("spacing"), nb::arg("full_support"), nb::arg("same_wall"), nb::arg("min_cosine"), nb::arg("border"),
        nb::arg("cell"), nb::arg("max_cells"));
}
