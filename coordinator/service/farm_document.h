#pragma once

#include <string_view>

#include "common/job/text/job_json.h"

namespace baton {

/// A job document as the coordinator works with it: its output folder stands under one name,
/// whichever the document has for it ("frames/", "./frames", a link). What of it is not there is
/// taken as it is written. Digests are those of the document. Errors: parse_job_document's.
Result<ParsedJobDocument> parse_farm_document(std::string_view text);

}  // namespace baton
