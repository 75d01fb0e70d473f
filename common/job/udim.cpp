#include "common/job/udim.h"

namespace baton {

bool has_tiles(const std::string& path) { return path.find(kTileMark) != std::string::npos; }

std::string tile_file(const std::string& path, int number) {
  std::string file = path;
  return file.replace(file.find(kTileMark), kTileMark.size(), std::to_string(number));
}

}  // namespace baton
