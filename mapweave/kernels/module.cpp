// The compiled kernels, one file each; every one has its NumPy twin in the module of its name.
#include <nanobind/nanobind.h>

#include "correlative.hpp"
#include "denials.hpp"
#include "main_directions.hpp"
#include "merging.hpp"
#include "point_map.hpp"
#include "polylines.hpp"
#include "segmentation.hpp"
#include "slivers.hpp"
#include "viewpoints.hpp"

namespace nb = nanobind;

NB_MODULE(_compiled, m) {
  m.doc() = "Compiled inner loops; see the modules beside for what they compute.";
  bind_correlative(m);
  bind_denials(m);
  bind_main_directions(m);
  bind_merging(m);
  bind_point_map(m);
  bind_polylines(m);
  bind_segmentation(m);
  bind_slivers(m);
  bind_viewpoints(m);
}
