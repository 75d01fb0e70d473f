#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/job/text/job_json.h"
#include "coordinator/journal/journal.h"

namespace baton {

/// A job document as the coordinator works with it: its output folder goes by the name that the
/// document has for it, "frames/" without its end, and leads to where that leads today, as for the
/// workers. Digests are those of the document. Those that were parsed lately are at hand, since one
/// of megabytes takes seconds. Called by any thread. Errors: parse_job_document's.
Result<ParsedJobDocument> parse_farm_document(std::string_view text);

/// What a text is.
struct FarmDocument {
  Result<ParsedJobDocument> parsed;  ///< see parse_farm_document()
  /// expect_written(), for one that somebody submits. One of the journal may be of an earlier
  /// build.
  Status written;
  std::size_t size_bytes = 0;
};
/// It stays at hand for as long as somebody has it.
using SharedDocument = std::shared_ptr<const FarmDocument>;
/// nullptr: it is not at hand.
SharedDocument document_at_hand(const Digest& text);
SharedDocument share_document(std::string_view text);
/// Of a job of the journal; of one that is not known, one that cannot be parsed.
Result<SharedDocument> journalled_document(Journal& journal, const Digest& job);

/// What a folder is, whichever name it goes by: its path without links, as far as it is there.
std::string resolve_folder(const std::string& folder);
/// The jobs of the journal, or those of this name, that write to a folder or have written to it, in
/// the order of submission. A folder is the same if a name that it has, or had when a job marked
/// it, leads to the same place today: it may have been moved, and a link have come in its place.
Result<std::vector<Digest>> jobs_in_folder(Journal& journal, const std::string& folder,
                                           const std::optional<std::string>& name = {});
/// What a message needs of documents.
struct NeededDocuments {
  std::vector<SharedDocument> at_hand;
  std::vector<std::string> texts;  ///< the others
};
/// Those of a folder's jobs. Error (bad_input): they have more than kMaxDocumentBytes.
Result<NeededDocuments> documents_in_folder(Journal& journal, const std::string& folder);
inline constexpr std::size_t kMaxDocumentBytes = 256u << 20;

}  // namespace baton
