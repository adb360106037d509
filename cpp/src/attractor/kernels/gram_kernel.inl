// Included by one file per instruction set, after gram_kernel.hpp and intrinsics.hpp. Defines
// add_gram in an anonymous namespace.

namespace sidestep::kernels {
namespace {

#include "../../math/kernels/simd.inl"

/// A block of the matrix stays in registers while the columns are gone through: `width` rows of `block` columns.
void add_gram(const double* columns, int num, int rows, double* matrix, int stride) noexcept {
  constexpr int block = 8;
  static_assert(block <= gram_room && width <= gram_room);
  for (int row = 0; row < rows; row += width) {
    const int height = rows - row < width ? rows - row : width;
    for (int first = 0; first < row + height; first += block) {
      Lanes sums[block] = {};
      for (const double *column = columns, *end = columns + num * rows; column != end; column += rows) {
        const Lanes x = load(column + row);
        for (int j = 0; j < block; ++j) {
          sums[j] += column[first + j] * x;
        }
      }
      for (int j = first; j < first + block && j < row + height; ++j) {
        for (int i = 0; i < height; ++i) {
          matrix[j * stride + row + i] += sums[j - first][i];
        }
      }
    }
  }
}

}  // namespace
}  // namespace sidestep::kernels
