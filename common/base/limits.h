#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>

/// Every limit of the program, in one place.
namespace baton::limits {

inline constexpr std::uint64_t kMaxJobFileBytes = 16ull << 20;
inline constexpr std::uint64_t kMaxAssetFileBytes = 8ull << 30;
inline constexpr std::uint64_t kMaxBlobBytes = 4ull << 30;
inline constexpr std::uint64_t kMaxMessageBytes = 64ull << 20;
inline constexpr std::uint64_t kMaxWorkerMessageBytes = 8ull << 20;  // what a worker says
/// Bytes from one connection without the end of a message.
inline constexpr std::uint64_t kMaxUnendedBytes = 2 * kMaxMessageBytes;
/// What may wait for one connection to be read, beside one message, and for all together.
inline constexpr std::uint64_t kMaxUnreadBytes = kMaxMessageBytes;
inline constexpr std::uint64_t kMaxUnreadBytesInAll = 8 * kMaxMessageBytes;
/// Of one address, that have said nothing for kSilenceAllowed since they were made.
inline constexpr int kMaxSilentConnections = 64;
/// Of the programs that `baton render` and `farm slurm` start; then it is begun anew.
inline constexpr std::uintmax_t kMaxLogBytes = 16ull << 20;
inline constexpr std::chrono::seconds kSilenceAllowed{2};
inline constexpr int kMaxMessageFrames = 4;      // with the peer's identity
inline constexpr int kMaxQueuedMessages = 4096;  // per connection, either way
inline constexpr int kMaxSections = 64;          // sections of one state or film file
inline constexpr int kMaxChannels = 256;         // channels of one image
inline constexpr int kMaxImageSide = 32768;
inline constexpr int kMaxOverscan = 4096;  // pixels on a side
/// Numbers of an EXR image whose data does not fill its display window: the rest costs a file
/// nothing.
inline constexpr std::int64_t kMaxFramedValues = std::int64_t{1} << 29;
inline constexpr int kMaxFrames = 100000;
inline constexpr int kMaxFrameNumber = 9999999;
/// Keys of one thing that moves: at each frame, at the one before it and at the one behind it.
inline constexpr int kMaxKeys = 3 * kMaxFrames;
inline constexpr int kMaxMaterials = 4096;
inline constexpr int kMaxMeshes = 4096;
inline constexpr int kMaxObjects = 100000;
inline constexpr int kMaxGltfIndex = 1 << 24;                  ///< meshes, primitives of a file
inline constexpr std::uint64_t kMaxGltfElements = 1ull << 28;  ///< an accessor without a view
/// Keys of all objects: 40 MB of a job's document.
inline constexpr std::size_t kMaxGltfKeys = 300000;
inline constexpr std::uint64_t kMaxGltfStride = 4096;  ///< bytes; the format allows 252
inline constexpr int kMaxTextureSide = 8192;
inline constexpr std::uint64_t kMaxTextureBytes = 4ull << 30;  ///< textures of a scene
inline constexpr int kMaxMetadata = 256;
inline constexpr int kMaxNameLength = 100;
inline constexpr int kMaxTextLength = 4096;
/// Of a coordinator's history.
inline constexpr std::int64_t kMaxEvents = 500000;
inline constexpr std::chrono::hours kMaxEventAge{24 * 90};
inline constexpr std::int32_t kMaxEventsTold = 10000;  ///< in one answer
/// Length of a frame's file name: file systems take 255, a temporary name has some more.
inline constexpr std::size_t kMaxFileNameLength = 200;
inline constexpr int kMaxJsonDepth = 32;
inline constexpr int kMaxFaultsReported = 100;
inline constexpr int kMinTileSize = 8;
inline constexpr int kMaxTileSize = 32768;
/// Side of the blocks of pixels that get the same number of rounds; tiles are whole numbers of
/// them.
inline constexpr int kAdaptiveBlock = 8;
/// Rounds of all pixels; they say how many more a block gets.
inline constexpr int kJudgingRounds = 2;
inline constexpr int kMaxSites = 16;       ///< sites of every pixel
inline constexpr int kMaxFineSites = 256;  ///< sites of pixels whose geometry is fine
/// Primary rays that tell how fine a pixel's geometry is.
inline constexpr int kGeometryProbes = 4;
inline constexpr int kMaxRounds = 65536;
inline constexpr int kMaxPreroll = 64;  ///< rounds
inline constexpr int kMaxBounces = 64, kPresetBounces = 4;
/// Paths of a pixel and round, for light between surfaces; and of one that shares what they find.
inline constexpr int kBouncePaths = 16, kSharedBouncePaths = 4;
/// Side of the blocks of pixels in which they share, a quarter of a block at a time; tiles are
/// whole numbers of them.
inline constexpr int kBounceBlock = 8;
inline constexpr int kBounceMembers = kBounceBlock * kBounceBlock / 4;
/// Shadow rays of each surface that such a path meets; and of one whose light is shared.
inline constexpr int kBounceRays = 2, kSharedBounceRays = 4;
inline constexpr int kMaxParticles = 64;
inline constexpr int kMaxPopulations = 2;  // parts of a pixel's particles
inline constexpr int kMaxCandidates = 8192;
inline constexpr int kMaxDistributions = 64;
inline constexpr int kMaxExchangeSide = 16;
inline constexpr int kMaxPartitions = 64;
inline constexpr int kMaxDilation = 8;
inline constexpr int kMaxMoves = 64;  ///< per distribution
inline constexpr int kMaxHistoryLimit = 1000;
inline constexpr int kMaxNeighbors = 8;  ///< per pixel
inline constexpr int kMaxNeighborRadius = 64;
/// Rays of a pixel of method pool, in numParticles.
inline constexpr int kMostPoolRays = 4;
inline constexpr int kMaxReferenceSamples = 1 << 24;
inline constexpr int kMaxCheckpointEvery = 1000;
inline constexpr int kMaxEnvironmentSide = 32768;
/// What blobs leave of a disk to frames and the journal.
inline constexpr std::uint64_t kStoreReserveBytes = 64ull << 20;
/// Films, before compression, of frames that are rendered ahead of an open one.
inline constexpr std::uint64_t kMaxFilmBytesAhead = 2ull << 30;
/// What a tile keeps of its rounds' surfaces from frame to frame.
inline constexpr std::uint64_t kMaxRoundSurfaceBytes = 1ull << 27;
/// Sites of a tile, where pixels differ in number, up to which what they see is kept.
inline constexpr std::size_t kMaxSitesAtOnce = 1u << 18;
/// Triangles of meshes in several places, in one flat hierarchy: some 600 MB. A second level costs
/// a third of the shadow rays' speed.
inline constexpr std::uint64_t kMaxCopiedTriangles = 4000000;
/// Frames whose moved geometry a worker keeps, per job.
inline constexpr std::size_t kMaxCachedPoses = 16;
inline constexpr int kMaxTasksPerJob = 4000000;
inline constexpr int kMaxTaskAttempts = 16;
inline constexpr int kMaxTaskLosses = 16;  ///< lost leases of a task that pause its job
inline constexpr int kMaxSecondsPerTask = 30 * 24 * 3600;
/// That a worker takes for a job's files before a task of it begins.
inline constexpr int kMaxSecondsToLoad = 900;
inline constexpr int kMaxLeasesPerWorker = 1024;
inline constexpr int kMaxPriority = 100;  ///< of a job
/// That users may give, unless the farm says otherwise.
inline constexpr int kMaxUserPriority = 75;
inline constexpr int kMaxJobs = 10000;
inline constexpr int kMaxWorkers = 4096;
inline constexpr std::size_t kMaxCachedJobs = 4;            ///< loaded scenes a worker keeps
inline constexpr std::size_t kMaxUnconfirmedReports = 256;  ///< reports a worker can repeat

}  // namespace baton::limits
