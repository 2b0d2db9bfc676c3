// The compiled kernels, one file each; every one has its NumPy twin in the module of its name.
#include <nanobind/nanobind.h>

#include "clearing.hpp"
#include "correlative.hpp"
#include "denials.hpp"
#include "evidence.hpp"
#include "fields.hpp"
#include "judging.hpp"
#include "main_directions.hpp"
#include "marks.hpp"
#include "merging.hpp"
#include "multiview.hpp"
#include "nearness.hpp"
#include "parts.hpp"
#include "place_views.hpp"
#include "point_map.hpp"
#include "polygons.hpp"
#include "polylines.hpp"
#include "pose_evidence.hpp"
#include "proposals.hpp"
#include "range_coder.hpp"
#include "raster_icp.hpp"
#include "rasters.hpp"
#include "sampling.hpp"
#include "scores.hpp"
#include "segmentation.hpp"
#include "shape_index.hpp"
#include "shifts.hpp"
#include "slivers.hpp"
#include "standing.hpp"
#include "viewpoints.hpp"
#include "windows.hpp"

namespace nb = nanobind;

NB_MODULE(_compiled, m) {
  m.doc() = "Compiled inner loops; see the modules beside for what they compute.";
  m.def("sources", [] { return MAPWEAVE_SOURCES; });
  bind_clearing(m);
  bind_correlative(m);
  bind_denials(m);
  bind_evidence(m);
  bind_fields(m);
  bind_judging(m);
  bind_main_directions(m);
  bind_marks(m);
  bind_merging(m);
  bind_multiview(m);
  bind_nearness(m);
  bind_parts(m);
  bind_place_views(m);
  bind_point_map(m);
  bind_polygons(m);
  bind_polylines(m);
  bind_proposals(m);
  bind_range_coder(m);
  bind_raster_icp(m);
  bind_rasters(m);
  bind_sampling(m);
  bind_scores(m);
  bind_segmentation(m);
  bind_shape_index(m);
  bind_shifts(m);  // of the views above
  bind_slivers(m);
  bind_standing(m);
  bind_viewpoints(m);
  bind_pose_evidence(m);  // of the points and viewpoints above
  bind_windows(m);
}
