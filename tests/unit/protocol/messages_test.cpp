#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>

#include "common/base/limits.h"
#include "common/base/members.h"
#include "common/protocol/messages.h"

namespace baton {
namespace {

using testing::HasSubstr;

const LeaseId kLease{{1, 2}, {TaskKind::assemble, 3, 4}, 5, 6};
const BlobRef kBlob{BlobKind::film, 7, 8, {9, 10}, 11};
/// Numbers the members that `fields` lists: factor, 2 factor, ...
struct Numbering {
  int factor = 1;
  int next = 0;
  template <class... T>
  void operator()(T&... members) {
    (number(members), ...);
  }

 private:
  template <class T>
  void number(T& member) {
    if constexpr (std::is_aggregate_v<T>) {
      std::apply(*this, members_of(member));
    } else {
      member = static_cast<T>(factor * ++next);
    }
  }
  template <class T, std::size_t N>
  void number(std::array<T, N>& members) {
    for (T& member : members) number(member);
  }
};

RenderStats numbered_stats(int factor) {
  Numbering numbering{factor};
  RenderStats stats;
  numbering(stats);
  return stats;
}

const RenderStats kStats = numbered_stats(1);
const JobSummary kSummary{
    {1, 2}, "name", "owner", "/out", JobStatus::failed, -3, 1, 2, 3, 4, 5, 6, 7, 8,
    9,      10,     11,      kStats};

const JobIdentity kIdentity{{9}, 2, {10, 11, 12}};
const TaskPlace kPlace{TaskKind::second_pass, FrameNumber(3), FrameNumber(4), 5, 6};
const UsualTime kUsual{1.5, 0.5, 7};
const JobNow kNow{JobActivity::waiting, "space", {1, 2, 3}};

/// One of each, in the order of the type codes, no member left at its default.
const std::vector<Message>& examples() {
  static const std::vector<Message> messages{
      WorkerHello{"w", "h\xc3\xb6st", 77, 1, 2, "baton 1", "AVX2", {kLease, kLease}},
      LeaseRequest{7},
      Heartbeat{{kLease}, true, 12345},
      TaskDone{kLease, {{kBlob, kBlob}, kStats, {{3, 4, kStats.sampling}}}, {5, 6, 7}, {"odd", ""}},
      TaskFailed{kLease, "no", true, true},
      JobDocumentRequest{{1, 2}},
      WorkerGoodbye{},
      WorkerWelcome{3, 500, "/store", "mark"},
      LeaseGrant{kLease, {kBlob}, {Step(4), Step(5)}, true, Step(6), 1.5, {{5, 6}}},
      LeaseRevoke{kLease},
      NoWork{250},
      HelloAgain{},
      JobDocument{{3, 4}, "{}", "mark", {9}},
      Shutdown{},
      SubmitJob{std::string("a\0b", 3), false, true, {FrameNumber(2)}},
      ListJobs{true},
      ShowJob{"abc"},
      CancelJob{"def"},
      StopCoordinator{},
      JobAccepted{kIdentity, {5, 6}, true, "all is kept"},
      JobList{{{kIdentity, kSummary, kNow}},
              {{"w",
                "h",
                1,
                2,
                {{{9}, kPlace, 1.5, kUsual}},
                true,
                true,
                34567,
                WorkerActivity::draining,
                2.5,
                "baton 1",
                "AVX2",
                {{{9}, "/shows"}}}},
              4,
              5,
              6.5,
              {{"u", Absence::turned_away, "2 threads", "SSE4", 0, 7}},
              {{"v", Absence::lost, "2 threads", "", 8, 9}}},
      ShownJob{kIdentity,
               {kSummary,
                {FrameNumber(1), FrameNumber(2), FrameNumber(3)},
                {"one", ""},
                {{FrameNumber(3), -1, kStats.sampling}},
                "space",
                "on",
                false,
                {"odd"}},
               true,
               {"4 rounds"},
               {FrameNumber(7)},
               kNow},
      Refused{4, "because"},
      PauseJob{"abc"},
      ResumeJob{"def"},
      OrderWorker{"w", WorkerOrder::hold},
      Drain{},
      ReportReceived{kLease},
      DeleteJob{"def"},
      LeaseReturn{kLease, "/shows", {kBlob}, {5, 6}, "ab"},
      StatesPublished{{1, 2}, {{kBlob, kBlob}}},
      RequestStates{{3, 4}, {{5, 6}}},
      BlobsLeft{kLease, {{5, 6}}},
      ListEvents{"abc", {{9}, 3, 4, 5, false, 6}},
      EventList{{{1, 2, FarmEventKind::task_lost, "a", {9}, true, kPlace, "w", "gone", 2.5}},
                {{FarmEventKind::task_done, 3, 4.5}},
                "/logs"},
      LockFrames{"abc", {FrameNumber(1), FrameNumber(5)}, true},
      SetPriority{"abc", 80},
      AskWhy{"abc", "w", true, FrameNumber(3), 4},
      ReasonChain{{{ReasonKind::store, "no room", {9}, true, kPlace, {"w"}, 1.5, kUsual, 2, 3, 4}}},
      ListTasks{"abc"},
      TaskList{{{{9}, true, kPlace, "w", true, 1.5, kUsual, 6, "boom"}}},
      AskRequeue{"abc", {FrameNumber(1), FrameNumber(5)}},
      RequeuePlan{kIdentity, 3, 4.5, "frames 1-5 are rendered again"},
      AskPicture{"abc", true, FrameNumber(3), true},
      PictureSource{kIdentity,
                    FrameNumber(3),
                    true,
                    "/shows/f.exr",
                    {0, 0, 4, 3},
                    {-1, -1, 5, 4},
                    "/store",
                    6,
                    {kBlob},
                    ", sweep 1 of 3"},
  };
  return messages;
}

Bytes text(std::string_view value) {
  const ByteView view = as_bytes_view(value);
  return {view.begin(), view.end()};
}

TEST(Messages, EveryTypeSurvivesTheRoundTrip) {
  ASSERT_EQ(examples().size(), std::variant_size_v<Message>);
  for (std::size_t type = 0; type < examples().size(); ++type) {
    ASSERT_EQ(examples()[type].index(), type);
    const std::vector<Bytes> frames = encode_message(examples()[type]);
    const Result<Message> decoded = decode_message(frames);
    ASSERT_TRUE(decoded.ok()) << "type " << type << ": " << decoded.error().message;
    EXPECT_EQ(decoded->index(), type);
    EXPECT_EQ(encode_message(*decoded), frames) << "type " << type;
  }
}

// Another kind or order of members is another version.
TEST(Messages, TheirBytesAreThoseOfTheVersion) {
  static_assert(kProtocolVersion == 21);
  Bytes all;
  for (const Message& message : examples()) {
    for (const Bytes& frame : encode_message(message))
      all.insert(all.end(), frame.begin(), frame.end());
  }
  EXPECT_EQ(digest_of(all).hex(), "cece4d61813ac929225286273ee5d331");
}

// Names are one line, what is told may be several; documents and paths are bytes.
TEST(Messages, TextsAreLegible) {
  const std::string odd = "a\xff\n\x1b[31m";
  const std::string line = "a\ufffd\\n\\x1b[31m", text = "a\ufffd\n\\x1b[31m";
  const auto sent = [](const auto& message) {
    return std::get<std::decay_t<decltype(message)>>(
        decode_message(encode_message(message)).value());
  };
  const WorkerHello hello{odd, odd, 0, 0, 0, odd, odd, {}};
  EXPECT_EQ(sent(hello).worker_id, line);
  EXPECT_EQ(sent(hello).host, line);
  EXPECT_EQ(sent(ShowJob{odd}).job, line);
  EXPECT_EQ(sent(TaskFailed{{}, odd}).message, text);
  EXPECT_EQ(sent(TaskDone{{}, {}, {}, {odd}}).notes.at(0), text);
  EXPECT_EQ(sent(Refused{1, odd}).message, text);
  EXPECT_EQ(sent(EventList{{{.worker = odd}}}).events.at(0).worker, text);
  EXPECT_EQ(sent(SubmitJob{odd}).json, odd);
  EXPECT_EQ(sent(WorkerWelcome{0, 0, odd, ""}).store_directory, odd);
  EXPECT_EQ(sent(PictureSource{.file = odd}).file, odd);
}

TEST(Messages, MembersArriveWhereTheyWereSent) {
  const Message decoded = decode_message(encode_message(examples()[3])).value();
  const auto& done = std::get<TaskDone>(decoded);
  EXPECT_EQ(done.lease, kLease);
  EXPECT_EQ(done.made.outputs, (std::vector{kBlob, kBlob}));
  EXPECT_EQ(done.made.stats, kStats);
}

TEST(Messages, BytesAreThoseOfTheGrammar) {
  const std::vector<Bytes> frames = encode_message(NoWork{0x01020304});
  EXPECT_EQ(frames[0], text(std::string_view("BATON\x15\x00", 7)));
  EXPECT_EQ(frames[1], text(std::string_view("\x0a\x00", 2)));
  EXPECT_EQ(frames[2], text("\x04\x03\x02\x01"));
}

TEST(Messages, TruncatedOrPaddedAtAnyByteIsRefused) {
  for (const Message& message : examples()) {
    const std::vector<Bytes> whole = encode_message(message);
    for (std::size_t frame = 0; frame < whole.size(); ++frame) {
      for (std::size_t size = 0; size < whole[frame].size(); ++size) {
        std::vector<Bytes> cut = whole;
        cut[frame].resize(size);
        EXPECT_FALSE(decode_message(cut).ok())
            << "type " << message.index() << ", frame " << frame << ", " << size;
      }
      std::vector<Bytes> padded = whole;
      padded[frame].push_back(std::byte{0});
      EXPECT_FALSE(decode_message(padded).ok())
          << "type " << message.index() << ", frame " << frame;
    }
  }
}

TEST(Messages, AnyChangedByteIsReadOrRefusedButNeverCrashes) {
  for (const Message& message : examples()) {
    for (std::size_t i = 0; i < encode_message(message)[2].size(); ++i) {
      for (const unsigned value : {0u, 1u, 0x7fu, 0xffu}) {
        std::vector<Bytes> frames = encode_message(message);
        frames[2][i] = std::byte(value);
        const Result<Message> decoded = decode_message(frames);
        if (!decoded.ok()) continue;
        // Texts may have become legible.
        const std::vector<Bytes> read = encode_message(*decoded);
        EXPECT_EQ(encode_message(decode_message(read).value()), read);
      }
    }
  }
}

TEST(Messages, AnotherVersionIsAVersionError) {
  std::vector<Bytes> frames = encode_message(ListJobs{});
  frames[0][5] = std::byte{kProtocolVersion + 1};
  frames.resize(1);  // nothing after the header may matter
  const Result<Message> decoded = decode_message(frames);
  ASSERT_FALSE(decoded.ok());
  EXPECT_EQ(decoded.error().kind, ErrorKind::version);
  EXPECT_THAT(decoded.error().message, HasSubstr("version 22, this program speaks 21"));
}

TEST(Messages, OtherProtocolsAreRefused) {
  for (const std::vector<Bytes>& frames :
       {std::vector<Bytes>{}, std::vector<Bytes>{text("")},
        std::vector<Bytes>{text("GET / HTTP/1.1")},
        std::vector<Bytes>{text(std::string_view("CHALK\x01\x00", 7)), text("ab"), text("")}}) {
    const Result<Message> decoded = decode_message(frames);
    ASSERT_FALSE(decoded.ok());
    EXPECT_EQ(decoded.error().kind, ErrorKind::bad_input);
  }
}

TEST(Messages, WrongNumberOfFramesIsRefused) {
  std::vector<Bytes> frames = encode_message(ListJobs{});
  frames.push_back({});
  EXPECT_THAT(decode_message(frames).error().message, HasSubstr("4 frames, expected 3"));
  frames.resize(2);
  EXPECT_FALSE(decode_message(frames).ok());
}

TEST(Messages, UnknownTypeIsRefused) {
  std::vector<Bytes> frames = encode_message(ListJobs{});
  frames[1] = text("\x17\x7f");
  EXPECT_THAT(decode_message(frames).error().message, HasSubstr("unknown type 32535"));
}

TEST(Messages, UnknownEnumValueIsRefused) {
  std::vector<Bytes> frames = encode_message(LeaseRevoke{kLease});
  frames[2][16] =
      std::byte{static_cast<unsigned char>(last_of(TaskKind{})) + 1};  // after the digest
  EXPECT_FALSE(decode_message(frames).ok());
}

TEST(Messages, OversizedBodyIsRefused) {
  std::vector<Bytes> frames = encode_message(ListJobs{});
  frames[2].resize(limits::kMaxMessageBytes + 1);
  EXPECT_THAT(decode_message(frames).error().message, HasSubstr("at most"));
}

TEST(Messages, WhatAWorkerSaysIsShort) {
  const SubmitJob document{std::string(limits::kMaxWorkerMessageBytes + 1, ' ')};
  EXPECT_TRUE(decode_message(encode_message(document)).ok());
  const TaskFailed report{{}, document.json};
  EXPECT_THAT(decode_message(encode_message(report)).error().message, HasSubstr("at most 8388608"));
}

TEST(Messages, AHugeCountReservesNothing) {
  std::vector<Bytes> frames = encode_message(Heartbeat{});
  frames[2] = text("\xff\xff\xff\xff");
  EXPECT_FALSE(decode_message(frames).ok());
}

TEST(RenderStats, MergingAddsEveryMember) {
  RenderStats sum = kStats;
  sum.merge(kStats);
  EXPECT_EQ(sum, numbered_stats(2));
}

}  // namespace
}  // namespace baton
