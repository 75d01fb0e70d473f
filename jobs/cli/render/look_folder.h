#pragma once

#include <filesystem>

#include "common/base/result.h"

namespace baton {

/// Makes the folder of a look, or sees that it is one, so that whatever is in it may be replaced.
/// may_replace: it becomes one whatever is in it. Errors: bad_input, files are in it and no look
/// has made it; io.
Status claim_look_folder(const std::filesystem::path& folder, bool may_replace);

}  // namespace baton
