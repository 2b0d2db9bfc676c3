// Arrays as they cross the border: C-contiguous, of one type, never converted in silence.
#pragma once
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <cstdint>
#include <initializer_list>
#include <memory>
#include <stdexcept>
#include <tuple>
#include <vector>

// Where the machine has wider registers they are used: the same results, for nothing is fused.
#if defined(__GNUC__) && !defined(__clang__) && defined(__x86_64__) && defined(__GLIBC__)
#define MAPWEAVE_WIDE __attribute__((target_clones("avx2", "default")))
#else
#define MAPWEAVE_WIDE
#endif

namespace nb = nanobind;

// The greatest whole number not above a number: `std::floor` is a call where registers are narrow.
inline int64_t floor_of(double value) {
  const int64_t whole = static_cast<int64_t>(value);
  return whole - (value < static_cast<double>(whole));
}

template <typename T, int N>
using In = nb::ndarray<const T, nb::ndim<N>, nb::c_contig, nb::device::cpu>;

template <typename T>
using Out = nb::ndarray<nb::numpy, T>;

// Hands `values` over to NumPy, without a copy, as an array of `shape`.
template <typename T>
Out<T> give(std::vector<T>&& values, std::initializer_list<size_t> shape) {
  auto* kept = new std::vector<T>(std::move(values));
  nb::capsule owner(kept, [](void* p) noexcept { delete static_cast<std::vector<T>*>(p); });
  return Out<T>(kept->data(), shape, owner);
}
