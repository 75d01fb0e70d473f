#include "common/job/text/job_json.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/base/files.h"
#include "common/base/limits.h"

namespace baton {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;

constexpr std::string_view kScene = R"("scene": {}, )";
constexpr std::string_view kLight = R"("environment": {"map": "sky.exr"})";

/// A job with the required keys and `more`.
std::string job_text(const std::string& more) {
  return "{\"name\": \"test\", " + std::string(kScene) + std::string(kLight) +
         (more.empty() ? "" : ", " + more) + "}";
}

std::string faults_of(const std::string& text) {
  const Result<JobSpec> job = parse_job(text, "job.json", "/jobs");
  return job.ok() ? "none" : job.error().message;
}
std::string faults(const std::string& more) { return faults_of(job_text(more)); }

JobSpec parsed(const std::string& text) {
  Result<JobSpec> job = parse_job(text, "job.json", "/jobs");
  EXPECT_TRUE(job.ok()) << (job.ok() ? "" : job.error().message);
  return job.ok() ? std::move(job).value() : JobSpec{};
}

/// A new folder for the test.
fs::path test_folder() {
  fs::path folder =
      fs::path(testing::TempDir()) / testing::UnitTest::GetInstance()->current_test_info()->name();
  fs::remove_all(folder);
  return folder;
}

TEST(JobJson, TakesEveryDefaultFromTheSpecification) {
  JobSpec expected;
  expected.name = "test";
  expected.environment.keys = {{1, "/jobs/sky.exr"}};
  expected.output.directory = "/jobs/test-frames";
  EXPECT_EQ(parsed(job_text("")), expected);
}

TEST(JobJson, ReadsBackWhatItWrites) {
  const fs::path examples = fs::path(BATON_SOURCE_DIR) / "jobs/examples";
  int count = 0;
  for (const fs::directory_entry& entry : fs::directory_iterator(examples)) {
    const std::string name = entry.path().filename().string();
    if (!name.ends_with(".json") || name.ends_with(".scene.json")) continue;
    const Result<JobSpec> job = load_job(entry.path());
    ASSERT_TRUE(job.ok()) << job.error().message;
    EXPECT_EQ(parsed(to_json(*job)), *job) << name;
    EXPECT_EQ(to_json(parsed(to_json(*job))), to_json(*job)) << name;
    ++count;
  }
  EXPECT_GE(count, 3);
}

TEST(JobJson, KeysOfACameraTakeItsUpWhereTheyHaveNone) {
  const JobSpec job = parsed(job_text(R"("camera": {"up": [1, 2, 0], "keys": [
      {"frame": 1, "position": [0, 0, 5], "lookAt": [0, 0, 0]},
      {"frame": 2, "position": [0, 0, 6], "lookAt": [0, 0, 0], "up": [0, 1, 1]}]})"));
  ASSERT_EQ(job.camera.keys.size(), 2u);
  EXPECT_EQ(job.camera.keys[0].up, (Vec3{1, 2, 0}));
  EXPECT_EQ(job.camera.keys[1].up, (Vec3{0, 1, 1}));
  EXPECT_EQ(parsed(to_json(job)), job);
}

TEST(JobJson, TakesAnEmptyBaseDirectoryForTheCurrentOne) {
  const Result<JobSpec> job = parse_job(job_text(""), "job.json", "");
  ASSERT_TRUE(job.ok()) << job.error().message;
  EXPECT_EQ(job->environment.keys.front().map, (fs::current_path() / "sky.exr").string());
}

TEST(JobJson, WritesFloatsAsShortDecimals) {
  EXPECT_THAT(to_json(parsed(job_text(R"("sampling": {"essRatioMin": 0.1})"))),
              HasSubstr("\"essRatioMin\": 0.1,"));
}

TEST(JobJson, IgnoresTheNameOfASchema) {
  EXPECT_EQ(parsed(job_text(R"("$schema": "job.schema.json")")), parsed(job_text("")));
  EXPECT_EQ(to_json(parsed(job_text(""))).find("$schema"), std::string::npos);
  EXPECT_EQ(faults(R"("$schema": 3)"),
            "job.json: $[\"$schema\"]: expected a text, such as \"3\", got 3");
}

TEST(JobJson, MaterialsTakeWhatTheyLeaveOutFromTheRest) {
  const JobSpec job = parsed(R"({"name": "test", "environment": {"map": "sky.exr"},
      "scene": {"materials": {"wall": {"type": "diffuse"}, "lamp": {"type": "diffuse"}}},
      "sampling": {"method": "mis", "numParticles": 8, "numCandidates": 32,
                   "byMaterial": {"wall": {"numParticles": 4}}}})");
  ASSERT_EQ(job.sampling.by_material.size(), 1u);
  const MaterialSampling expected{.method = Method::mis, .num_particles = 4, .num_candidates = 32};
  EXPECT_EQ(job.sampling.by_material.at("wall"), expected);
  EXPECT_EQ(parsed(to_json(job)), job);
  EXPECT_EQ(to_json(parsed(job_text(""))).find("byMaterial"), std::string::npos);
}

TEST(JobJson, ReportsAllFaultsAtOnce) {
  EXPECT_EQ(faults_of(R"({"nam": "x", "priority": 101, "image": {"width": "wide", "tilesize": 64},
                          "environment": {"map": "sky.exr"}})"),
            "job.json: $.name: expected a value, got none\n"
            "job.json: $.priority: expected an integer in [0, 100], got 101\n"
            "job.json: $.image.width: expected an integer in [1, 32768], got \"wide\"\n"
            "job.json: $.image.tilesize: unknown key; did you mean \"tileSize\"?\n"
            "job.json: $.scene: expected a value, got none\n"
            "job.json: $.nam: unknown key; did you mean \"name\"?");
}

TEST(JobJson, ListsTheKnownKeysWhenNoneIsNear) {
  EXPECT_EQ(
      faults(R"("state": {"zzzzzzzz": 1})"),
      "job.json: $.state.zzzzzzzz: unknown key; there is carry, checkpointEvery, preroll, keep");
}

TEST(JobJson, NamesPlaceAndExpectationOfEachKindOfFault) {
  const std::string long_pattern =
      R"("output": {"pattern": ")" + std::string(200, 'a') + R"(.exr"})";
  const std::pair<const char*, const char*> cases[] = {
      {R"("specificationVersion": 2)", "$.specificationVersion: expected 1, got 2"},
      {R"("seed": -1)", "$.seed: expected an integer in [0, 18446744073709551615], got -1"},
      {R"("image": {"width": 1.5})", "$.image.width: expected an integer in [1, 32768], got 1.5"},
      {R"("image": {"height": null})",
       "$.image.height: expected an integer in [1, 32768], got null"},
      {R"("image": {"sites": 4, "maxSites": 36})",
       "$.image.maxSites: expected one of 4, 16, 64, 256, got 36"},
      {R"("image": {"sites": 16, "maxSites": 4})",
       "$.image.maxSites: expected one of 16, 64, 256, got 4"},
      {R"("image": {"sites": 5})", "$.image.sites: expected one of 1, 4, 9, 16, got 5"},
      {R"("image": [1])", "$.image: expected an object, got a list of 1"},
      {R"("state": {"carry": 1})", "$.state.carry: expected true or false, got 1"},
      {R"("camera": {"verticalFovDeg": 180})",
       "$.camera.verticalFovDeg: expected a number in (0, 180), got 180"},
      {R"("camera": {"verticalFovDeg": 1e-300})",
       "$.camera.verticalFovDeg: expected a number that does not round"},
      {R"("camera": {"position": [0, 0]})",
       "$.camera.position: expected a list of 3 numbers, got a list of 2"},
      {R"("camera": {"position": [0, true, 1]})", "$.camera.position[1]: expected a number in"},
      {R"("camera": {"position": [0, 0, 0]})",
       "$.camera.lookAt: expected another point than position"},
      {R"("camera": {"up": [0, 0, 2]})", "$.camera.up: expected a direction across the view"},
      {R"("camera": {"up": [0, 0, 0]})", "$.camera.up: expected a direction, got [0, 0, 0]"},
      {R"("metadata": {"odd\nkey": "1"})",
       "$.metadata: expected names of 1 to 4096 bytes without control characters, got "
       "\"odd\\nkey\""},
      {"\"metadata\": {\"back\": \"\u202egpj.exr\"}",
       "$.metadata.back: expected a text of 1 to 4096 bytes without control characters, got "},
      {"\"metadata\": {\"window\": \"\u009b2J\"}",
       "$.metadata.window: expected a text of 1 to 4096 bytes without control characters, got "},
      {R"("metadata": {"odd key": 1})",
       "$.metadata[\"odd key\"]: expected a text, such as \"1\", got 1"},
      {R"("frames": "4-1")", "$.frames: expected a last frame not before the first, got \"4-1\""},
      {R"("frames": 3)", "$.frames: expected a text"},
      {R"("sampling": {"method": "sequentail"})",
       "got \"sequentail\"; did you mean \"sequential\"?"},
      {R"("sampling": {"numCandidates": 8})",
       "$.sampling.numCandidates: expected at least numParticles (16), got 8"},
      {R"("sampling": {"refreshRatio": 2, "refreshCandidates": 8})",
       "$.sampling.refreshCandidates: expected at least numParticles (16), got 8"},
      {R"("sampling": {"method": "environment", "misCompensation": true})",
       "$.sampling.misCompensation: expected false unless sampling.method is mis or auto, as what "
       "is dim is then left to the BRDF's samples, got true"},
      {R"("sampling": {"method": "mis", "misCompensation": true, "byMaterial": {"a": {}}})",
       "$.sampling.misCompensation: expected false, as sampling.byMaterial is given, got true"},
      {R"("sampling": {"method": "mis", "byMaterial": {"a": {"method": "pool"}}})",
       "$.sampling.byMaterial.a.method: expected one of environment, brdf, mis, bidirectional"},
      {R"("sampling": {"method": "mis", "byMaterial": {"a": {"numParticles": 200}}})",
       "$.sampling.byMaterial.a.numParticles: expected an integer in [1, 64], got 200"},
      {R"("sampling": {"method": "mis", "byMaterial": {"a": {}}})",
       "$.sampling.byMaterial.a: no such material in scene.materials"},
      {R"("sampling": {"method": "pool", "byMaterial": {"a": {}}})",
       "$.sampling.byMaterial: expected none unless sampling.method is environment, brdf, mis or "
       "bidirectional, got \"pool\""},
      {R"("sampling": {"method": "mis", "byMaterial": {"a": {}}}, "visibility": {"correlated": true})",
       "$.visibility.correlated: expected false, as sampling.byMaterial is given, got true"},
      {R"("sampling": {"method": "restir", "byMaterial": {"a": {}}})",
       "$.sampling.byMaterial: expected none unless sampling.method is environment, brdf, mis or "
       "bidirectional, got \"restir\""},
      {R"("sampling": {"method": "restir"}, "visibility": {"correlated": true})",
       "$.visibility.correlated: expected false, as sampling.method is restir, whose samples are "
       "carried as one set, got true"},
      {R"("sampling": {"method": "ratio"}, "visibility": {"correlated": true})",
       "$.visibility.correlated: expected false, as sampling.method is ratio, whose rays are not "
       "its "
       "samples, got true"},
      {R"("sampling": {"historyLimit": 0})",
       "$.sampling.historyLimit: expected an integer in [1, 1000], got 0"},
      {R"("sampling": {"numNeighbors": 9})",
       "$.sampling.numNeighbors: expected an integer in [0, 8], got 9"},
      {R"("sampling": {"neighborRadius": 65})",
       "$.sampling.neighborRadius: expected an integer in [1, 64], got 65"},
      {R"("sampling": {"refreshRatio": 1})",
       "$.sampling.refreshRatio: expected a number in (1, 1000000], got 1"},
      {R"("output": {"aovs": ["lns", "lns"]})",
       "$.output.aovs[1]: expected each word once, got \"lns\" twice"},
      {R"("output": {"aovs": ["dept"]})", "$.output.aovs[0]: expected one of lns, visibility"},
      {R"("output": {"pattern": "a/b.exr"})",
       "$.output.pattern: expected a file name that ends in .exr"},
      {R"("output": {"directory": "a\u0000b"})",
       "$.output.directory: expected a text of 1 to 4096 bytes without"},
      {R"("frames": "1-2", "output": {"pattern": "a.exr"})", "$.output.pattern: expected a '#'"},
      {long_pattern.c_str(), "$.output.pattern: expected a file name of at most 200 bytes"},
      {R"("frames": "1-100000", "image": {"width": 32768, "height": 32768, "tileSize": 8})",
       "$: expected at most 4000000 tasks"},
      {R"("image": {"width": 32768, "height": 32768, "tileSize": 32768})",
       "$.image: expected tiles of at most"},
  };
  for (const auto& [more, expected] : cases) {
    EXPECT_THAT(faults(more), HasSubstr(std::string("job.json: ").substr(0, 9))) << more;
    EXPECT_THAT(faults(more), HasSubstr(expected)) << more;
  }
}

TEST(JobJson, NamesLineAndColumnOfSyntaxErrors) {
  EXPECT_THAT(faults_of("{\n  \"name\": }"),
              HasSubstr("job.json: line 2, column 11: syntax error"));
  EXPECT_THAT(faults_of("{} x"), HasSubstr("job.json: line 1, column 4: syntax error"));
  EXPECT_THAT(faults_of(""), HasSubstr("job.json: line 1, column 1: syntax error"));
  EXPECT_THAT(faults_of("{\"name\": NaN}"), HasSubstr("job.json: line 1, column 10: syntax error"));
  EXPECT_THAT(faults_of("{\"name\": 1e999}"), HasSubstr("number overflow parsing '1e999'"));
}

TEST(JobJson, RefusesKeysGivenTwiceAndDeepNesting) {
  EXPECT_EQ(faults_of(R"({"a": [{"b": 1}, {"b": 1, "b": 2}], "a": 1})"),
            "job.json: $.a[1].b: expected one value, got the key twice\n"
            "job.json: $.a: expected one value, got the key twice");
  EXPECT_EQ(faults_of(std::string(100000, '[') + std::string(100000, ']')),
            "job.json: expected at most 32 levels, got more");
}

Status written(const std::string& text) {
  const Result<ParsedJobDocument> document = parse_job_document(text);
  return document ? expect_written(*document, text) : Status(document.error());
}

// What a coordinator gets may be anybody's: it reads no other file, and keeps nothing that says
// nothing.
TEST(JobJson, ADocumentIsWhole) {
  JobSpec job = parsed(job_text(""));
  job.motion.max_px = 1;
  ParsedJobDocument document{.job = job,
                             .assets = {{job.environment.keys.front().map, {1, 2}}},
                             .digest = {},
                             .picture = {}};
  const std::string text = with_sweeps(document, 2);
  EXPECT_TRUE(written(text));
  EXPECT_FALSE(written(text + " "));
  EXPECT_THAT(written(" " + text).error().message, HasSubstr("as `baton` writes"));
  const std::size_t scene = text.find("\"scene\":{");
  ASSERT_NE(scene, std::string::npos);
  const std::string filed = text.substr(0, scene) + R"("scene":"/etc/hostname","more":{)" +
                            text.substr(scene + std::string("\"scene\":{").size());
  EXPECT_THAT(parse_job_document(filed).error().message,
              HasSubstr("$.job.scene: expected an object, got \"/etc/hostname\""));
}

// A parser that takes time with the square of an object's members would need half an hour.
TEST(JobJson, ManyMembersAreReadInTimeThatGrowsWithThem) {
  std::string text = "{\"scene\": {\"materials\": {";
  for (int i = 0; i < 200'000; ++i)
    text += fmt::format("{}\"m{}\": {{\"type\": \"diffuse\"}}", i > 0 ? ", " : "", i);
  EXPECT_THAT(faults_of(text + "}}}"), HasSubstr("expected an object of at most 4096"));
}

TEST(JobJson, WhatIsLongIsShownInPart) {
  const std::string digits(1'000'000, '1'), word(1'000'000, 'k');
  for (const std::string& text : {"{\"seed\": " + digits + "}", "{\"" + word + "\": 1}", "{" + word,
                                  "{\"name\": \"" + word}) {
    EXPECT_LT(faults_of(text).size(), 5000) << text.substr(0, 30);
  }
}

TEST(JobJson, CountsFaultsPastTheLimit) {
  std::string text = "\"state\": {\"x0\": 0";
  for (int i = 1; i < 150; ++i) text += ", \"x" + std::to_string(i) + "\": 0";
  EXPECT_THAT(faults(text + "}"), HasSubstr("... and 50 more faults"));
}

TEST(JobJson, ChecksTheSceneByName) {
  const std::string scene = R"({"name": "test", "environment": {"map": "sky.exr"}, "scene": {
      "materials": {"red": {"type": "phong", "kd": 0.7, "ks": 0.6}, "blue": {"type": "diffuse", "kd": 1}, "x": {}},
      "meshes": {"ball": "ball.ply", "cup": {"path": "cup.stl"}},
      "objects": [{"mesh": "bal", "material": "red"}, {"mesh": "cup", "material": "gold", "scale": [1, 0, 1]}],
      "ground": {"size": 0}}})";
  EXPECT_EQ(faults_of(scene),
            "job.json: $.scene.materials.blue.kd: unknown key; there is type, color, colorTexture, "
            "normalTexture, emission, emissionTexture, alpha, alphaCutoff, alphaBlend\n"
            "job.json: $.scene.materials.red.ks: expected kd + ks <= 1, or the material makes "
            "light, got 1.3\n"
            "job.json: $.scene.materials.x.type: expected a value, got none\n"
            "job.json: $.scene.meshes.cup.path: expected a file name that ends in .ply .obj .off "
            ".gltf .glb, got \"cup.stl\"\n"
            "job.json: $.scene.objects[0].mesh: expected the name of a mesh, got \"bal\"; did you "
            "mean \"ball\"?\n"
            "job.json: $.scene.objects[1].material: expected the name of a material, got \"gold\"; "
            "there is blue, red, x\n"
            "job.json: $.scene.objects[1].scale[1]: expected a number in (0, 1000000000], got 0\n"
            "job.json: $.scene.ground.material: expected a value, got none\n"
            "job.json: $.scene.ground.size: expected a number in (0, 1000000000], got 0");
}

TEST(JobJson, ReadsShortFormsOfMeshAndScale) {
  const JobSpec job = parsed(R"({"name": "test", "environment": {"map": "sky.exr"}, "scene": {
      "materials": {"m": {"type": "diffuse"}}, "meshes": {"a": "m/../a.ply", "b": {"path": "/b.obj", "smoothNormals": false}},
      "objects": [{"mesh": "a", "material": "m", "scale": 2, "fitHeight": 1.5}]}})");
  EXPECT_EQ(job.scene.meshes.at("a"), (MeshSpec{"/jobs/a.ply", true}));
  EXPECT_EQ(job.scene.meshes.at("b"), (MeshSpec{"/b.obj", false}));
  EXPECT_EQ(job.scene.objects.at(0).scale, (Vec3{2, 2, 2}));
  EXPECT_EQ(job.scene.objects.at(0).fit_height, 1.5f);
  EXPECT_FALSE(job.scene.ground.has_value());
}

TEST(JobJson, ReadsTheSceneFromAFileOfItsOwn) {
  const fs::path folder = test_folder();
  ASSERT_TRUE(
      write_file_atomic(folder / "parts/s.json", as_bytes_view(R"({"meshes": {"a": "a.ply"}})"))
          .ok());
  const std::string text =
      R"({"name": "t", "scene": "parts/s.json", "environment": {"map": "a.exr"}})";
  const Result<JobSpec> job = parse_job(text, "job.json", folder);
  ASSERT_TRUE(job.ok()) << job.error().message;
  EXPECT_EQ(job->scene.meshes.at("a").path, (folder / "parts/a.ply").string());

  // Faults name that file and the path inside it.
  const std::string file = (folder / "parts/s.json").string();
  ASSERT_TRUE(
      write_file_atomic(file, as_bytes_view(R"({"mesh": {}, "objects": [{"mesh": "a"}]})")).ok());
  const Result<JobSpec> faulty = parse_job(text, "job.json", folder);
  ASSERT_FALSE(faulty.ok());
  EXPECT_THAT(faulty.error().message,
              HasSubstr(file + ": $.mesh: unknown key; did you mean \"meshes\"?"));
  EXPECT_THAT(faulty.error().message,
              HasSubstr(file + ": $.objects[0].material: expected a value, got none"));

  ASSERT_TRUE(fs::remove(file));
  const Result<JobSpec> missing = parse_job(text, "job.json", folder);
  ASSERT_FALSE(missing.ok());
  EXPECT_THAT(missing.error().message, HasSubstr(file + ": cannot open"));
}

std::string with_environment(const std::string& environment) {
  return R"({"name": "test", "frames": "5-7", "scene": {}, "environment": )" + environment + "}";
}

TEST(JobJson, ReadsTheThreeFormsOfTheEnvironment) {
  EXPECT_EQ(parsed(with_environment(R"({"map": "a.exr"})")).environment.keys,
            (std::vector<EnvironmentKey>{{1, "/jobs/a.exr"}}));

  const EnvironmentSpec keyed =
      parsed(with_environment(
                 R"({"keys": [{"frame": 1, "map": "a.exr"}, {"frame": 6.5, "map": "b.hdr"}]})"))
          .environment;
  EXPECT_TRUE(keyed.interpolate);
  EXPECT_EQ(keyed.keys, (std::vector<EnvironmentKey>{{1, "/jobs/a.exr"}, {6.5, "/jobs/b.hdr"}}));

  const EnvironmentSpec numbered =
      parsed(with_environment(R"({"frames": "x#/sky.###.exr"})")).environment;
  EXPECT_FALSE(numbered.interpolate);
  EXPECT_EQ(numbered.keys, (std::vector<EnvironmentKey>{{5, "/jobs/x#/sky.005.exr"},
                                                        {6, "/jobs/x#/sky.006.exr"},
                                                        {7, "/jobs/x#/sky.007.exr"}}));
}

TEST(JobJson, RefusesAnEnvironmentThatIsNotOneForm) {
  EXPECT_THAT(faults_of(with_environment("{}")),
              HasSubstr("$.environment: expected exactly one of map"));
  EXPECT_THAT(faults_of(with_environment(R"({"keys": []})")),
              HasSubstr("$.environment: expected exactly one of map"));
  EXPECT_THAT(faults_of(with_environment(R"({"map": "a.exr", "frames": "s.#.exr"})")),
              HasSubstr("got several"));
  EXPECT_THAT(faults_of(with_environment(R"({"frames": "sky.exr"})")),
              HasSubstr("expected a numbered file name"));
  EXPECT_THAT(faults_of(with_environment(R"({"map": "a.png"})")),
              HasSubstr("that ends in .exr .hdr, got \"a.png\""));
  EXPECT_THAT(
      faults_of(with_environment(
          R"({"keys": [{"frame": 2, "map": "a.exr"}, {"frame": 2, "map": "b.exr"}]})")),
      HasSubstr("$.environment.keys: expected ascending frames without duplicates, got 2 after 2"));
}

TEST(JobJson, ExplainsWhatIsGivenAndWhatIsDefault) {
  const fs::path file = test_folder() / "job.json";
  ASSERT_TRUE(write_file_atomic(file, as_bytes_view(job_text(R"("image": {"width": 32})"))).ok());
  const Result<std::vector<JobSetting>> settings = explain_job(file);
  ASSERT_TRUE(settings.ok()) << settings.error().message;
  std::vector<std::string> lines;
  for (const JobSetting& s : *settings)
    lines.push_back(s.path + " " + s.value + (s.given ? " given" : " default"));
  EXPECT_THAT(lines, Contains("$.image.width 32 given"));
  EXPECT_THAT(lines, Contains("$.image.height 360 default"));
  EXPECT_THAT(lines, Contains("$.environment.keys[0].frame 1.0 given"));
  EXPECT_THAT(lines, Contains("$.environment.rotation.axis [0.0,1.0,0.0] default"));
  EXPECT_THAT(lines, Contains("$.camera.verticalFovDeg 40.0 default"));
}

TEST(JobDocument, CarriesTheDigestsOfAllAssets) {
  const fs::path folder = test_folder();
  ASSERT_TRUE(write_file_atomic(folder / "sky.exr", as_bytes_view("map")).ok());
  const Result<JobSpec> job = parse_job(job_text(""), "job.json", folder);
  ASSERT_TRUE(job.ok()) << job.error().message;
  const Result<std::string> text = make_job_document(*job);
  ASSERT_TRUE(text.ok()) << text.error().message;

  const Result<ParsedJobDocument> document = parse_job_document(*text);
  ASSERT_TRUE(document.ok()) << document.error().message;
  EXPECT_EQ(document->job, *job);
  EXPECT_THAT(document->assets,
              ElementsAre(AssetDigest{(folder / "sky.exr").string(), digest_of("map")}));
  EXPECT_EQ(document->digest, digest_of(*text));
  EXPECT_TRUE(verify_assets(document->assets).ok());

  // A changed file and a missing one are told apart.
  ASSERT_TRUE(write_file_atomic(folder / "sky.exr", as_bytes_view("other")).ok());
  EXPECT_THAT(verify_assets(document->assets).error().message,
              HasSubstr("sky.exr: changed since the job was submitted"));
  fs::remove(folder / "sky.exr");
  EXPECT_THAT(verify_assets(document->assets).error().message, HasSubstr("sky.exr: cannot open"));
  EXPECT_THAT(make_job_document(*job).error().message, HasSubstr("sky.exr: cannot open"));
}

// Who has checked the list has checked every file that the job names.
TEST(JobDocument, TheListOfFilesIsThatOfTheJob) {
  const fs::path folder = test_folder();
  for (const char* const name : {"a.exr", "sky.exr"})
    ASSERT_TRUE(write_file_atomic(folder / name, as_bytes_view("map")).ok());
  const JobSpec job = parse_job(job_text(""), "job.json", folder).value();
  const std::string text = make_job_document(job).value();
  const std::string item = text.substr(
      text.find("{\"path\""), text.find('}', text.find("{\"path\"")) + 1 - text.find("{\"path\""));
  const auto with_list = [&](const std::string& list) {
    std::string changed = text;
    return parse_job_document(changed.replace(changed.find(item), item.size(), list))
        .error()
        .message;
  };
  ASSERT_TRUE(parse_job_document(text).ok());
  const std::string sky = (folder / "sky.exr").string(), other = (folder / "a.exr").string();
  std::string of_other = item;
  of_other.replace(of_other.find(sky), sky.size(), other);
  const std::string expected = "job document: $.assets: expected the 1 files that the job names";
  EXPECT_THAT(with_list(""), AllOf(HasSubstr(expected), HasSubstr(sky + " among them")));
  EXPECT_THAT(with_list(of_other), AllOf(HasSubstr(expected), HasSubstr(sky + " among them")));
  EXPECT_THAT(with_list(item + "," + item), HasSubstr("got also " + sky));
}

TEST(JobDocument, RefusesADocumentThatIsDamaged) {
  EXPECT_THAT(parse_job_document("{}").error().message,
              HasSubstr("job document: $.assets: expected a value, got none"));
  EXPECT_THAT(
      parse_job_document(R"({"job": {}, "assets": [{"path": "/a", "digest": "1"}]})")
          .error()
          .message,
      HasSubstr("job document: $.assets[0].digest: expected 32 hexadecimal digits, got \"1\""));
}

}  // namespace
}  // namespace baton
