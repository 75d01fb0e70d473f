// Writes the inputs that fuzzing begins with, of the formats that are not text: small files of
// every kind, as the program writes them, and with payloads that are not packed, which are easier
// to change. usage: fuzz_make_corpus tests/fuzz/corpus
#include <fmt/format.h>

#include <filesystem>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "common/base/files.h"
#include "common/base/members.h"
#include "common/base/section_file.h"
#include "common/image/image_io.h"
#include "common/protocol/messages.h"
#include "common/state/memory_plane.h"
#include "tests/support/first_pass.h"

namespace baton {
namespace {

namespace fs = std::filesystem;

// ---- section files ------------------------------------------------------------------------------

/// The same file with its payloads as they are.
Bytes unpacked(const Bytes& bytes, const SectionTag& magic, std::uint16_t version) {
  const SectionFile file = *decode_section_file(bytes, magic, version, "corpus");
  std::vector<SectionView> views;
  for (const Section& s : file.sections)
    views.push_back({s.tag, s.required, s.stride, s.payload, Packing::none});
  return encode_sections(magic, version, views);
}

Status write_both(const fs::path& folder, const std::string& name, const Bytes& bytes,
                  const SectionTag& magic, std::uint16_t version) {
  BATON_TRY(write_file_atomic(folder / name, bytes));
  return write_file_atomic(folder / (name + "-unpacked"), unpacked(bytes, magic, version));
}

/// A state of 4 x 3 pixels, the first of them background.
SampleState small_state(const StateFormat& format, std::int32_t particles,
                        std::int32_t populations) {
  SampleState state;
  state.picture = {1, 2};
  state.step = Step(5);
  state.tile = 7;
  state.resize(format, {8, 16, 12, 19}, particles, populations);
  const SamplePlanes samples(state);
  const auto n = static_cast<std::size_t>(particles);
  const auto k = static_cast<std::size_t>(populations);
  for (std::size_t row = k; row < state.source.size(); ++row) {
    state.source[row] = static_cast<PixelSource>(1 + row % 4);
    samples.lns[row] = 1.5f + static_cast<float>(row);
    samples.lns_fresh[row] = 2;
  }
  for (std::size_t i = n; i < samples.weight.size(); ++i) {
    samples.direction[i] = static_cast<OctDirection>(i * 2654435761u);
    samples.weight[i] = static_cast<float>(k) / static_cast<float>(n);
    samples.site[i] = static_cast<std::uint8_t>(i % 16);
  }
  return state;
}

SampleState state_with_memory() {
  SampleState state = small_state(memory_format(), 0, 1);
  for (std::size_t pixel = 1; pixel < state.num_pixels(); ++pixel)
    pixel_memory_plane(state)[pixel].light_noise = 0x3f80;
  for (std::size_t bin = 3; bin < BlockMemory::kCount; bin += 100)
    block_memory_plane(state)[0].cells[bin] = {200, 30};
  return state;
}

Status write_states(const fs::path& folder) {
  constexpr SectionTag kMagic{'B', 'S', 'T', '1'};
  SampleState confident = small_state(weighed_sample_format(), 2, 1);
  confidence_plane(confident).back() = 9;
  const std::pair<const char*, SampleState> states[] = {
      {"particles", small_state(sample_format(), 4, 1)},
      {"populations", small_state(sample_format(), 4, 2)},
      {"confidence", confident},
      {"memory", state_with_memory()}};
  for (const auto& [name, state] : states)
    BATON_TRY(write_both(folder, name, encode_state(state), kMagic, kStateVersion));
  return {};
}

Status write_films(const fs::path& folder) {
  constexpr SectionTag kMagic{'B', 'T', 'F', '1'};
  const FilmTile colour{{4, 8, 6, 9}, {"R", "normal.X"}, {0.5f, -0.0f, 1e30f, 1e-40f}};
  const FilmTile flat{{0, 0, 8, 4}, {"R", "G", "B"}, std::vector<float>(96, 0.25f)};
  BATON_TRY(write_both(folder, "colour",
                       encode_film_tile(colour, {{1, 2}, Step(3), FilmPass::first}), kMagic, 2));
  return write_both(folder, "flat", encode_film_tile(flat, {{1, 2}, Step(3), FilmPass::second}),
                    kMagic, 2);
}

Status write_first_passes(const fs::path& folder) {
  constexpr SectionTag kMagic{'B', 'F', 'S', '1'};
  FirstPassSamples s = test::small_first_pass();
  BATON_TRY(write_both(folder, "mask", encode_first_pass_samples(s), kMagic, 1));
  s.lns.assign(40, 1.5f);
  return write_both(folder, "published", encode_first_pass_samples(s), kMagic, 1);
}

// ---- messages -----------------------------------------------------------------------------------

/// Gives every member that `fields` lists a value.
struct Filling {
  template <class... T>
  void operator()(T&... members) {
    (fill(members), ...);
  }

 private:
  template <class T>
  void fill(T& member) {
    if constexpr (std::is_aggregate_v<T>) {
      std::apply(*this, members_of(member));
    } else if constexpr (std::is_same_v<T, std::string>) {
      member = "text";
    } else if constexpr (std::is_same_v<T, Digest>) {
      member = {++next, ++next};
    } else if constexpr (std::is_enum_v<T>) {
      member = last_of(member);
    } else if constexpr (requires { T(std::int32_t{}).value(); }) {  // an Ordinal
      member = T(static_cast<std::int32_t>(++next));
    } else {
      member = static_cast<T>(++next);
    }
  }
  template <class T>
  void fill(std::vector<T>& members) {
    members.resize(2);
    for (T& member : members) fill(member);
  }
  template <class T, std::size_t N>
  void fill(std::array<T, N>& members) {
    for (T& member : members) fill(member);
  }
  std::uint64_t next = 0;
};

Status write_message(const fs::path& path, const Message& message) {
  const std::vector<Bytes> frames = encode_message(message);
  Bytes bytes = frames[1];
  bytes.insert(bytes.end(), frames[2].begin(), frames[2].end());
  return write_file_atomic(path, bytes);
}

template <std::size_t... Types>
Status write_messages(const fs::path& folder, std::index_sequence<Types...>) {
  Status status;
  const auto write_type = [&]<std::size_t Type>(std::integral_constant<std::size_t, Type>) {
    std::variant_alternative_t<Type, Message> body;
    Filling filling;
    filling(body);
    if (status) status = write_message(folder / fmt::format("type{:02}", Type), Message(body));
  };
  (write_type(std::integral_constant<std::size_t, Types>()), ...);
  return status;
}

// ---- conversations with a coordinator -----------------------------------------------------------

/// As fuzz_service.cpp reads it: who speaks, and what is said.
void add_words(Bytes& input, int peer, const Message& message) {
  const std::vector<Bytes> frames = encode_message(message);
  const auto length = static_cast<std::uint16_t>(frames[2].size());
  input.push_back(static_cast<std::byte>(peer));
  input.insert(input.end(), frames[1].begin(), frames[1].end());
  for (int shift = 0; shift < 16; shift += 8)
    input.push_back(static_cast<std::byte>(length >> shift));
  input.insert(input.end(), frames[2].begin(), frames[2].end());
}

Status write_conversations(const fs::path& folder) {
  constexpr Digest kJob{0xaaaaaaaaaaaaaaaa, 0xaaaaaaaaaaaaaaaa};
  constexpr int kWorker = 0, kOther = 1, kViewer = 3, kOwner = 4, kAdmin = 6;
  const std::string id = kJob.hex();
  const LeaseId lease{kJob, render_task(Run(0), 0), 1, 1},
      never{kJob, render_task(Run(1), 1), 9, 1};
  const BlobRef film{BlobKind::film, 0, 0, {1, 2}, 3}, state{BlobKind::state, 1, 0, {3, 4}, 5};
  TaskDone done{lease, {}};
  done.made.outputs = {film, {BlobKind::film, 1, 0, {5, 6}, 3}, state};
  done.made.frames = {{0, 0, {}}, {1, 0, {}}};
  using Words = std::vector<std::pair<int, Message>>;
  AskWhy why;
  why.job = id;
  const std::map<std::string, Words> conversations{
      {"work", Words{{kWorker, Heartbeat{{lease}}},
                     {kWorker, done},
                     {kWorker, LeaseRequest{2}},
                     {kWorker, BlobsLeft{lease, {{7, 8}}}},
                     {kWorker, StatesPublished{kJob, {{state, state}}}}}},
      {"failures", Words{{kWorker, TaskFailed{lease, "boom", false, false}},
                         {kOther, TaskFailed{never, "never granted", true, false}},
                         {kOther, Heartbeat{{never, lease}}},
                         {kOther, TaskFailed{lease, "full", false, true}},
                         {kWorker, LeaseReturn{lease, {}, {}, {}, {}}},
                         {kWorker, WorkerGoodbye{}}}},
      {"questions", Words{{kViewer, ListJobs{}},
                          {kViewer, ShowJob{id}},
                          {kViewer, why},
                          {kViewer, ListTasks{id}},
                          {kViewer, ListEvents{}},
                          {kViewer, AskRequeue{id, {FrameNumber(1)}}},
                          {kViewer, AskPicture{id, false, FrameNumber(0), true}},
                          {kWorker, JobDocumentRequest{kJob}}}},
      {"orders", Words{{kOwner, PauseJob{id}},
                       {kOwner, ResumeJob{id}},
                       {kOwner, SetPriority{id, 60}},
                       {kOwner, LockFrames{id, {FrameNumber(2)}, false}},
                       {kAdmin, OrderWorker{"one"}},
                       {kAdmin, CancelJob{id}},
                       {kAdmin, DeleteJob{id}},
                       {kAdmin, StopCoordinator{}}}},
      {"documents", Words{{kOwner, SubmitJob{"{}", false, false}},
                          {kAdmin, SubmitJob{R"({"job": {}, "assets": []})", true, false}}}}};
  for (const auto& [name, words] : conversations) {
    Bytes input;
    for (const auto& [peer, message] : words) add_words(input, peer, message);
    BATON_TRY(write_file_atomic(folder / name, input));
  }
  return {};
}

// ---- images -------------------------------------------------------------------------------------

Status write_images(const fs::path& folder) {
  const FilmTile colour{{0, 0, 4, 2}, {"B", "G", "R"}, std::vector<float>(24, 0.25f)};
  const FilmTile aovs{{0, 0, 3, 2}, {"depth", "normal.X"}, std::vector<float>(12, 7.5f)};
  for (const char* compression : {"none", "rle", "zips", "zip", "piz"}) {
    BATON_TRY(write_exr(folder / fmt::format("{}.exr", compression), colour,
                        {.half_float = true, .compression = compression, .metadata = {}}));
  }
  BATON_TRY(write_exr(folder / "aovs.exr", aovs,
                      {.half_float = false, .compression = "zip", .metadata = {{"job", "x"}}}));

  // Radiance: rows of eight pixels with and without run lengths.
  const std::string header = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 8\n";
  const std::string pixel = "\x80\x40\x20\x81";
  std::string flat = header;
  for (int x = 0; x < 8; ++x) flat += pixel;
  std::string runs = header + std::string("\x02\x02\x00\x08", 4);
  for (const char value : pixel) runs += std::string("\x88") + value;
  BATON_TRY(write_file_atomic(folder / "flat.hdr", as_bytes_view(flat)));
  return write_file_atomic(folder / "runs.hdr", as_bytes_view(runs));
}

Status write_corpora(const fs::path& folder) {
  BATON_TRY(write_states(folder / "state"));
  BATON_TRY(write_films(folder / "film"));
  BATON_TRY(write_first_passes(folder / "first_pass"));
  BATON_TRY(write_messages(folder / "messages",
                           std::make_index_sequence<std::variant_size_v<Message>>()));
  BATON_TRY(write_conversations(folder / "service"));
  return write_images(folder / "images");
}

}  // namespace
}  // namespace baton

int main(int argc, char** argv) {
  const baton::Status status = baton::write_corpora(argc > 1 ? argv[1] : "tests/fuzz/corpus");
  if (status) return 0;
  fmt::print(stderr, "{}\n", status.error().message);
  return 1;
}
