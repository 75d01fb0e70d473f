#pragma once

#include <gtest/gtest.h>

#include <fstream>
#include <string>
#include <string_view>

namespace baton::test {

/// Writes a file of the test's own and returns its path.
inline std::string write_test_file(const std::string& name, std::string_view bytes) {
  std::string path = testing::TempDir() + name;
  std::ofstream(path, std::ios::binary) << bytes;
  return path;
}

/// A unit square in the plane y = 0: two triangles, facing up.
inline constexpr std::string_view kSquareOff =
    "OFF\n4 2 0\n0 0 0\n0 0 1\n1 0 1\n1 0 0\n3 0 1 2\n3 0 2 3\n";

/// A cube with edge 2 around the origin: six quadrilaterals, facing out.
inline constexpr std::string_view kCubeOff =
    "OFF\n8 6 0\n-1 -1 -1\n1 -1 -1\n1 1 -1\n-1 1 -1\n-1 -1 1\n1 -1 1\n1 1 1\n-1 1 1\n"
    "4 0 3 2 1\n4 4 5 6 7\n4 0 1 5 4\n4 2 3 7 6\n4 0 4 7 3\n4 1 2 6 5\n";

}  // namespace baton::test
