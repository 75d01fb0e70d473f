#pragma once

#include <filesystem>
#include <string>

#include "common/base/digest.h"
#include "common/base/files.h"
#include "common/base/patiently.h"
#include "common/base/result.h"

namespace baton {

/// The token of a folder is a text in a small file of it. Who reads it there sees the folder that
/// somebody else marked, and not an empty one that only has its name.

/// Where the coordinator of this token marks the output folder of an open job. Another one may have
/// the same job open in the same folder.
std::filesystem::path output_token_file(const std::filesystem::path& folder, const Digest& job,
                                        const std::string& token);

/// The token in `file`; where there is none yet, `known` or, if that is empty, a new random one (16
/// hex digits).
Result<std::string> make_token(const std::filesystem::path& file, const std::string& known = {});
/// Writes a token that is known, and a line after it, if there is one; in one of `roots`.
Status write_token(const std::filesystem::path& file, const std::string& token,
                   const std::string& line = {}, const Roots& roots = {});
/// The line after the token; empty: there is none. The error, io, says that the token does not
/// stand there and names the folder of `file`, or why the file cannot be read; with patience that
/// is looked at again.
Result<std::string> read_after_token(const std::filesystem::path& file, const std::string& token,
                                     Patience* patience = nullptr);
/// Whether the token stands in `file`; false: another one does, or nothing has this name. Error,
/// io: the file cannot be read now.
Result<bool> has_token(const std::filesystem::path& file, const std::string& token);
/// The same error as read_after_token's, or none.
Status expect_token(const std::filesystem::path& file, const std::string& token,
                    Patience* patience = nullptr);

}  // namespace baton
