#!/usr/bin/env bash
# nanobind 3.1.0 with numpy 2.4.6: a kernel that writes into an array it was handed fills a
# temporary copy, if the array is float32, of integers, or strided; the caller's stays as it was.
# Needs a C++17 compiler (g++) and Python's headers.
#
# Expected: the parameter is declared as a contiguous one-dimensional array of doubles in memory of
# the CPU, and not as const: it is an out-argument. An array that is something else cannot be
# filled, so the overload should not match and TypeError come, as for a read-only array (it does)
# and for big-endian doubles (it does).
#
# What happens: arguments are converted implicitly unless told otherwise, arrays too, and nanobind
# does not tell arguments that are read from those that are written: the converted copy is filled
# and dropped. No error, no warning, zeros in the caller's array. A column of a 2D array, or
# float32 taken from a scan, is all it needs; tests with np.zeros(n) pass. `.noconvert()` on the
# argument is what makes it an out-argument.
#
# Seen:
#   float64:    loose [1.0, 2.0, 3.0]   strict [1.0, 2.0, 3.0]
#   float32:    loose [0.0, 0.0, 0.0]   strict TypeError
#   int64:      loose [0.0, 0.0, 0.0]   strict TypeError
#   column:     loose [0.0, 0.0, 0.0]   strict TypeError
#   big-endian: loose TypeError   strict TypeError
#   read-only:  loose TypeError   strict TypeError
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
python="$work/venv/bin/python"
"$work/venv/bin/pip" install -q --disable-pip-version-check --no-cache-dir \
    nanobind==3.1.0 numpy==2.4.6
cat > "$work/kernel.cpp" <<'EOF'
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

namespace nb = nanobind;
using Out = nb::ndarray<double, nb::ndim<1>, nb::c_contig, nb::device::cpu>;

static void count(Out out) {
    for (size_t i = 0; i < out.shape(0); ++i) out(i) = double(i + 1);
}

NB_MODULE(kernel, m) {
    m.def("loose", &count, nb::arg("out"));
    m.def("strict", &count, nb::arg("out").noconvert());
}
EOF
nanobind=$(dirname "$("$python" -m nanobind --include_dir)")
headers=$("$python" -c 'import sysconfig; print(sysconfig.get_paths()["include"])')
suffix=$("$python" -c 'import sysconfig; print(sysconfig.get_config_var("EXT_SUFFIX"))')
g++ -std=c++17 -O1 -shared -fPIC -fvisibility=hidden -I"$headers" -I"$nanobind/include" \
    -I"$nanobind/ext/robin_map/include" "$work/kernel.cpp" "$nanobind/src/nb_combined.cpp" \
    -o "$work/kernel$suffix"
PYTHONPATH="$work" "$python" - <<'EOF'
import sys

import kernel
import numpy as np


def read_only():
    array = np.zeros(3)
    array.flags.writeable = False
    return array


MAKE = {
    "float64": lambda: np.zeros(3),
    "float32": lambda: np.zeros(3, np.float32),
    "int64": lambda: np.zeros(3, np.int64),
    "column": lambda: np.zeros((3, 2))[:, 0],
    "big-endian": lambda: np.zeros(3, ">f8"),
    "read-only": read_only,
}


def filled(function, array):
    try:
        function(array)
    except TypeError:
        return "TypeError"
    return array.astype(float).tolist()


found = {
    name: (filled(kernel.loose, make()), filled(kernel.strict, make()))
    for name, make in MAKE.items()
}
for name, (loose, strict) in found.items():
    print(f"{name + ':':11} loose {loose}   strict {strict}")
full, empty = [1.0, 2.0, 3.0], [0.0, 0.0, 0.0]
wanted = {name: (empty, "TypeError") for name in ("float32", "int64", "column")}
wanted |= {name: ("TypeError", "TypeError") for name in ("big-endian", "read-only")}
sys.exit(0 if found == {"float64": (full, full), **wanted} else 1)
EOF
