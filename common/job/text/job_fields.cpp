#include "common/job/text/job_fields.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "common/base/limits.h"
#include "common/base/suggest.h"
#include "common/job/aov.h"
#include "common/job/plan/estimate.h"
#include "common/job/plan/sequence.h"
#include "common/job/text/frame_range.h"

namespace baton {
namespace {

void name_fields(JobArchive& a, JobSpec& job) {
  if (!a.text(required("name"), job.name)) return;
  // The name becomes a folder.
  const bool good = job.name.size() <= limits::kMaxNameLength &&
                    job.name.find('/') == std::string::npos && !job.name.starts_with('.');
  if (!good) {
    a.fault("name",
            fmt::format("at most {} bytes without '/' and not starting with '.'",
                        limits::kMaxNameLength),
            fmt::format("\"{}\"", job.name.substr(0, 60)));
  }
}

void frame_fields(JobArchive& a, JobSpec& job) {
  std::string text = format_frames(job.frames);
  if (!a.text("frames", text)) return;
  Result<std::vector<FrameNumber>> frames = parse_frames(text);
  if (frames) {
    job.frames = std::move(frames).value();
  } else {
    a.fault("frames", frames.error().message);
  }
}

void method_that_draws_anew(JobArchive& a, Key key, Method& method) {
  std::vector<std::string_view> names;
  for (const std::string_view name : method_names()) {
    if (traits(method_of(name)).draws_anew) names.push_back(name);
  }
  std::string name(traits(method).name);
  if (a.word(key, name, names)) method = method_of(name);
}

/// N, M and the share of the BRDF; Sampling is SamplingSpec or MaterialSampling.
template <class Sampling>
void count_fields(JobArchive& a, Sampling& sampling) {
  a.integer("numParticles", sampling.num_particles, 1, limits::kMaxParticles);
  a.integer("numCandidates", sampling.num_candidates, 1, limits::kMaxCandidates);
  if (sampling.num_candidates < sampling.num_particles) {
    a.fault("numCandidates", fmt::format("at least numParticles ({})", sampling.num_particles),
            std::to_string(sampling.num_candidates));
  }
  a.number("brdfFraction", sampling.brdf_fraction, kUnitRange);
}

/// Settings of single materials; what they leave out is as in the rest of the image.
void material_fields(JobArchive& a, SamplingSpec& sampling, const SceneSpec& scene) {
  const auto visit = [&](const std::string& name, MaterialSampling& material) {
    method_that_draws_anew(a, "method", material.method);
    count_fields(a, material);
    if (scene.materials.contains(name) || scene.gltf) return;
    std::vector<std::string> names;
    for (const auto& entry : scene.materials) names.push_back(entry.first);
    a.fault("", fmt::format("no such material in scene.materials{}", suggestion(name, names)));
  };
  const bool draws_anew = traits(sampling.method).draws_anew;
  const MaterialSampling rest{draws_anew ? sampling.method : Method::bidirectional,
                              sampling.num_particles, sampling.num_candidates,
                              sampling.brdf_fraction};
  a.named_from("byMaterial", sampling.by_material, rest, limits::kMaxMaterials, visit,
               {.present = false});
  if (!sampling.by_material.empty() && !draws_anew) {
    a.fault("byMaterial", "none unless sampling.method is environment, brdf, mis or bidirectional",
            fmt::format("\"{}\"", traits(sampling.method).name));
  }
  if (!sampling.by_material.empty() && sampling.mis_compensation)
    a.fault("misCompensation", "false, as sampling.byMaterial is given", "true");
}

void fields(JobArchive& a, SamplingSpec& sampling, const SceneSpec& scene) {
  a.choice("method", sampling.method, method_names());
  count_fields(a, sampling);
  a.boolean("misCompensation", sampling.mis_compensation);
  if (sampling.mis_compensation && !traits(sampling.method).compensates) {
    a.fault("misCompensation",
            "false unless sampling.method is mis or auto, as what is dim is then left to the "
            "BRDF's samples",
            "true");
  }
  a.integer("numDistributions", sampling.num_distributions, 1, limits::kMaxDistributions);
  a.integer("numMoves", sampling.num_moves, 1, limits::kMaxMoves);
  a.choice("lnsUpdate", sampling.lns_update, kLnsUpdates);
  a.number("essRatioMin", sampling.ess_ratio_min, kUnitRange);
  a.choice("resampling", sampling.resampling, kResamplingSchemes);
  a.number("localMoveDeg", sampling.local_move_deg, {.min = 0, .max = 90, .min_open = true});
  a.number("localMoveFraction", sampling.local_move_fraction, kUnitRange);
  method_that_draws_anew(a, "startMethod", sampling.start_method);
  a.integer("refreshEvery", sampling.refresh_every, 0, limits::kMaxFrames);
  a.number("refreshRatio", sampling.refresh_ratio, {.min = 1, .max = 1e6, .min_open = true});
  a.integer("refreshCandidates", sampling.refresh_candidates, 1, limits::kMaxCandidates);
  if (sampling.refresh_ratio && sampling.refresh_candidates < sampling.num_particles) {
    a.fault("refreshCandidates", fmt::format("at least numParticles ({})", sampling.num_particles),
            std::to_string(sampling.refresh_candidates));
  }
  a.integer("historyLimit", sampling.history_limit, 1, limits::kMaxHistoryLimit);
  a.integer("numNeighbors", sampling.num_neighbors, 0, limits::kMaxNeighbors);
  a.integer("neighborRadius", sampling.neighbor_radius, 1, limits::kMaxNeighborRadius);
  a.boolean("reuseVisibility", sampling.reuse_visibility);
  a.number("targetError", sampling.target_error, {.min = 0, .max = 10, .min_open = true});
  a.number("timeBudget", sampling.time_budget, {.min = 0, .max = 1e9, .min_open = true});
  if (sampling.target_error && sampling.time_budget) {
    a.fault("timeBudget", "at most one of targetError and timeBudget", "both");
  } else if ((sampling.target_error || sampling.time_budget) &&
             sampling.method != Method::automatic) {
    a.fault("method", "\"auto\" with targetError or timeBudget",
            fmt::format("\"{}\"", traits(sampling.method).name));
  }
  a.integer("referenceSamples", sampling.reference_samples, 2, limits::kMaxReferenceSamples);
  material_fields(a, sampling, scene);
}

void fields(JobArchive& a, QualitySpec& quality, const SamplingSpec& sampling) {
  a.integer("rounds", quality.rounds, 1, limits::kMaxRounds);
  if (quality.rounds > 1 && sampling.method == Method::automatic) {
    a.fault("rounds", "1, as sampling.method is auto, which chooses for one",
            std::to_string(quality.rounds));
  }
  a.integer("sweeps", quality.sweeps, 1, limits::kMaxRounds);
  if (const std::int64_t all = std::int64_t{quality.rounds} * quality.sweeps;
      quality.sweeps > 1 && all > limits::kMaxRounds) {
    a.fault("sweeps", fmt::format("at most {} rounds in all sweeps", limits::kMaxRounds),
            std::to_string(all));
  }
  if (quality.sweeps > 1 && sampling.method == Method::automatic) {
    a.fault("sweeps", "1, as sampling.method is auto, which chooses for one",
            std::to_string(quality.sweeps));
  }
  a.number("adaptiveThreshold", quality.adaptive_threshold,
           {.min = 0, .max = 1e6, .min_open = true});
  a.boolean("refinable", quality.refinable);
  a.number("noiseThreshold", quality.noise_threshold, {.min = 0, .max = 1e6, .min_open = true});
  a.number("timeLimit", quality.time_limit, {.min = 0, .max = 1e9, .min_open = true});
  a.integer("maxRounds", quality.max_rounds, 0, limits::kMaxRounds);
  if (quality.max_rounds > 0 && quality.max_rounds < quality.rounds) {
    a.fault("maxRounds", fmt::format("0, or at least quality.rounds, {}", quality.rounds),
            std::to_string(quality.max_rounds));
  }
}

void fields(JobArchive& a, VisibilitySpec& visibility, const SamplingSpec& sampling,
            const QualitySpec& quality) {
  a.boolean("correlated", visibility.correlated);
  a.choice("form", visibility.form, kSecondPassForms);
  a.choice("mask", visibility.mask, kMaskPolicies);
  a.integer("tileSize", visibility.tile_size, 2, limits::kMaxExchangeSide);
  a.integer("partitions", visibility.partitions, 1, limits::kMaxPartitions);
  a.integer("dilate", visibility.dilate, 0, limits::kMaxDilation);
  if (!visibility.correlated) return;

  // The second pass needs samples, two independent halves of them unless told otherwise.
  if (const MethodTraits& method = traits(sampling.method); !method.no_second_pass.empty()) {
    a.fault("correlated",
            fmt::format("false, as sampling.method is {}, {}", method.name, method.no_second_pass),
            "true");
  }
  if (!sampling.by_material.empty()) {
    a.fault("correlated", "false, as sampling.byMaterial is given", "true");
  }
  if (quality.rounds > 1) {
    a.fault("correlated",
            fmt::format("false, as quality.rounds is {}, and the second pass takes one round",
                        quality.rounds),
            "true");
  }
  if (quality.sweeps > 1 || quality.refinable || quality.may_grow()) {
    a.fault("correlated",
            "false, as quality asks for sweeps, and the frames of a second pass have no mean",
            "true");
  }
  if (visibility.mask != MaskPolicy::same_samples && sampling.num_particles % 2 != 0) {
    a.fault("mask", "same-samples, or an even sampling.numParticles to be halved",
            std::to_string(sampling.num_particles));
  }
}

void fields(JobArchive& a, LightSpec& light) {
  a.integer("bounces", light.bounces, 0, limits::kMaxBounces);
  a.boolean("filterGlossy", light.filter_glossy);
}

void fields(JobArchive& a, OutputSpec& output, const JobSpec& job) {
  if (output.directory.empty()) output.directory = job.name + "-frames";
  a.path("directory", output.directory);
  a.text("pattern", output.pattern);
  const auto got = [&] { return fmt::format("\"{}\"", output.pattern.substr(0, 60)); };
  if (output.pattern.find('/') != std::string::npos || !output.pattern.ends_with(".exr")) {
    a.fault("pattern", "a file name that ends in .exr, without folders", got());
  } else if (output.pattern.size() > limits::kMaxFileNameLength) {
    a.fault("pattern", fmt::format("a file name of at most {} bytes", limits::kMaxFileNameLength),
            got());
  } else if (job.frames.size() > 1 && output.pattern.find('#') == std::string::npos) {
    a.fault("pattern", "a '#' for each digit of the frame number, as there are several frames",
            got());
  }
  a.choice("background", output.background, kBackgrounds);
  FileSequence plate = output.plate.value_or(FileSequence{});
  const auto visit_plate = [&] {
    fields(a, plate,
           {".exr", ".hdr", ".png", ".jpg", ".jpeg", ".tif", ".tiff", ".tga", ".bmp", ".webp"});
  };
  if (a.object("plate", visit_plate, {.shorthand = "files", .present = output.plate.has_value()}))
    output.plate = plate;
  if (output.background == Background::plate && !output.plate)
    a.fault("plate", "a picture or numbered pictures, as background is plate", "none");
  a.choice("shadows", output.shadows, kShadowForms);
  if (output.shadows == ShadowForm::alpha && output.background != Background::transparent)
    a.fault("shadows", "channels, as background is not transparent", "\"alpha\"");
  const NamedSet<Aov> denoise{"denoise", {Aov::normal, Aov::variance, Aov::albedo, Aov::motion}};
  a.choices("aovs", output.aovs, aov_names(), std::span(&denoise, 1));
  a.choice("pixelType", output.pixel_type, kPixelTypes);
  a.word("compression", output.compression, kCompressions);
  a.number("framesPerSecond", output.frames_per_second, {1, 1000});
  a.choice("naming", output.naming, kFrameNamings);
  a.boolean("clampNegative", output.clamp_negative);
  a.boolean("look", output.is_look);
}

void fields(JobArchive& a, StateSpec& state) {
  a.boolean("carry", state.carry);
  a.integer("checkpointEvery", state.checkpoint_every, 1, limits::kMaxCheckpointEvery);
  a.integer("preroll", state.preroll, 0, limits::kMaxPreroll);
  a.choice("keep", state.keep, kStateKeeps);
}

/// Whether blocks of pixels can have numbers of rounds of their own.
void check_adaptive(JobArchive& a, const JobSpec& job) {
  if (!job.quality.adaptive_threshold) return;
  const auto refuse = [&](const std::string& why) {
    a.fault("quality", "no adaptiveThreshold, as " + why,
            fmt::format("{}", *job.quality.adaptive_threshold));
  };
  if (job.quality.rounds <= limits::kJudgingRounds) {
    refuse(fmt::format("the first {} of quality.rounds judge, and there are {}",
                       limits::kJudgingRounds, job.quality.rounds));
  } else if (!rounds_have_own_sites(job)) {
    refuse(fmt::format("the rounds of {} go on from each other where it carries samples",
                       traits(job.sampling.method).name));
  }
}

/// Whether pixels can have numbers of sites of their own.
void check_max_sites(JobArchive& a, const JobSpec& job) {
  if (!has_fine_sites(job)) return;
  const auto refuse = [&](const std::string& why) {
    a.fault("image", "no maxSites, as " + why, fmt::format("{}", job.image.max_sites));
  };
  if (job.visibility.correlated) {
    refuse("visibility.correlated has pixels of equal sites");
  } else if (job.sampling.method == Method::automatic) {
    refuse("auto may choose a method whose samples belong to sites");
  } else if (!rounds_have_own_sites(job)) {
    refuse(fmt::format("the samples that {} carries belong to sites",
                       traits(job.sampling.method).name));
  }
}

/// Whether the method says what light would arrive if none were blocked.
void check_unshadowed(JobArchive& a, const JobSpec& job) {
  for (const Aov aov : {Aov::unshadowed, Aov::blocked}) {
    if (!has_aov(job, aov)) continue;
    const std::string_view name = traits(aov).name;
    const auto refuse = [&](std::string_view why) {
      a.fault("output", fmt::format("no {} among aovs, as {}", name, why),
              fmt::format("\"{}\"", name));
    };
    if (job.visibility.correlated) refuse("the second pass exchanges shadows between pixels");
    const bool forgets = traits(job.sampling.method).carried == Carried::weighed_samples &&
                         job.sampling.reuse_visibility;
    if (forgets && carries_state(job))
      refuse("samples that were blocked are forgotten (sampling.reuseVisibility)");
  }
}

/// What no single value shows: too many tasks, tiles that fit into no blob, noise that nobody
/// tells.
void check_whole(JobArchive& a, const JobSpec& job) {
  if (std::int64_t{job.quality.sweeps} * static_cast<std::int64_t>(job.frames.size()) >
      limits::kMaxTasksPerJob) {
    return a.fault("quality",
                   fmt::format("at most {} frames in all sweeps", limits::kMaxTasksPerJob),
                   fmt::format("{} sweeps of {}", job.quality.sweeps, job.frames.size()));
  }
  if (const std::string key = catcher_key(job); job.visibility.correlated && !key.empty())
    a.fault(
        "visibility",
        fmt::format("correlated false, as {} is true, whose shadows no second pass exchanges", key),
        "true");
  if (job.quality.noise_threshold && !tells_noise(job)) {
    a.fault(
        "quality",
        fmt::format("no noiseThreshold, as the noise of {} is not known where it carries samples",
                    traits(job.sampling.method).name),
        fmt::format("{}", *job.quality.noise_threshold));
  }
  check_adaptive(a, job);
  check_max_sites(a, job);
  check_unshadowed(a, job);
  const JobEstimate estimate = estimate_job(job);
  if (estimate.tasks() > limits::kMaxTasksPerJob) {
    a.fault(
        "",
        fmt::format("at most {} tasks (larger image.tileSize or state.checkpointEvery make fewer)",
                    limits::kMaxTasksPerJob),
        std::to_string(estimate.tasks()));
  }
  if (estimate.largest_blob_bytes > static_cast<std::int64_t>(limits::kMaxBlobBytes)) {
    a.fault("image",
            fmt::format("tiles of at most {} bytes (a smaller tileSize makes smaller ones)",
                        limits::kMaxBlobBytes),
            std::to_string(estimate.largest_blob_bytes));
  }
}

}  // namespace

void fields(JobArchive& a, JobSpec& job) {
  a.integer("specificationVersion", job.specification_version, 1, 1);
  name_fields(a, job);
  a.integer("priority", job.priority, 0, limits::kMaxPriority);
  a.texts("metadata", job.metadata, limits::kMaxMetadata);
  frame_fields(a, job);
  a.integer("seed", job.seed);
  a.object("image", [&] { fields(a, job.image); });
  const bool says_camera = a.object("camera", [&] { fields(a, job.camera); });
  a.object(required("scene"), [&] { fields(a, job.scene); }, {.file = true});
  if (job.scene.gltf && !says_camera) job.camera.node = kFirstCamera;
  if (!job.camera.node.empty() && !job.scene.gltf)
    a.fault("camera", "no node, as there is no scene.gltf that has it",
            fmt::format("\"{}\"", job.camera.node));
  a.object(required("environment"), [&] { fields(a, job.environment, job.frames); });
  a.object("light", [&] { fields(a, job.light); });
  a.object("motion", [&] { fields(a, job.motion); });
  a.object("sampling", [&] { fields(a, job.sampling, job.scene); });
  a.object("quality", [&] { fields(a, job.quality, job.sampling); });
  a.object("visibility", [&] { fields(a, job.visibility, job.sampling, job.quality); });
  a.object("output", [&] { fields(a, job.output, job); });
  a.object("state", [&] { fields(a, job.state); });
  a.integer("maxRetriesPerTask", job.max_retries_per_task, 0, limits::kMaxTaskAttempts - 1);
  a.integer("maxSecondsPerTask", job.max_seconds_per_task, 1, limits::kMaxSecondsPerTask);
  a.integer("maxFailedTasks", job.max_failed_tasks, 1, limits::kMaxTasksPerJob);
  a.integer("maxFailuresPerWorker", job.max_failures_per_worker, 1, limits::kMaxTasksPerJob);
  // Editors read it; it says nothing of the job.
  std::string schema;
  a.text("$schema", schema);
  check_whole(a, job);
}

}  // namespace baton
