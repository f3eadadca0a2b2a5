// Stage match: exact but for the position.
#include "conformance/cases/stage/stage_case.hpp"
#include "conformance/scenes/template_jobs.hpp"

namespace defrec::conformance {
namespace {

using Change = std::function<void(MatchScene&)>;

struct Counts {
    uint32_t landmarks, features;
};

void add(std::vector<StageCase>& cases, const char* name, const char* title, const Counts& counts,
         const Change& change, bool smoke = true, bool slow = false) {
    const auto make = [=](CaseRun&, uint32_t frame) {
        MatchScene scene = match_scene(70 + frame, counts.landmarks, counts.features);
        if (change) change(scene);
        return match_job(scene);
    };
    cases.push_back(float_case(DEFREC_STAGE_MATCH, name, title, make, match_spread, smoke, slow));
}

// Descriptors of few kinds, so that most distances are equal.
void make_ties(MatchScene& scene) {
    Random random(5);
    const auto few = [&](uint32_t* descriptor) {
        for (int word = 0; word < 8; ++word)
            descriptor[word] = word < 2 ? 1u << random.below(3) : 0;
    };
    for (defrec_landmark& landmark : scene.landmarks) few(landmark.descriptor);
    for (defrec_feature& feature : scene.features) few(feature.descriptor);
    scene.params.max_distance = 256;
    scene.params.ratio = 256;
}

// As a tracker has it: features and disparity are the reference's of two frames.
StageJob tracked(CaseRun& run, uint32_t frame) {
    const auto features_of = [&](const Gray& picture) {
        auto params = blank<defrec_orb_params>();
        params.width = picture.width;
        params.height = picture.height;
        params.capacity = 200;
        const auto outputs = run_plainly(run.reference(), orb_job(params, picture, nullptr, false));
        auto features = as<defrec_feature>(outputs[1]);
        features.resize(as<uint32_t>(outputs[0])[0]);
        return features;
    };
    const StereoPair pair = stereo_pair(160, 120, 80 + frame);
    auto stereo = blank<defrec_stereo_params>();
    stereo.width = 160;
    stereo.height = 120;
    stereo.disparities = 32;
    MatchScene scene = match_scene(1, 0, 0, 160, 120);
    scene.params.landmarks = scene.params.features = 200;
    scene.disparity = as<int16_t>(run_plainly(
        run.reference(), stereo_job(stereo, pair.left, pair.right, nullptr, nullptr, false))[0]);
    for (const defrec_feature& feature : features_of(stereo_pair(160, 120, 80 + frame, 12).right)) {
        defrec_landmark landmark{};
        std::copy_n(feature.descriptor, 8, landmark.descriptor);
        scene.landmarks.push_back(landmark);
    }
    scene.features = features_of(pair.left);
    scene.count = uint32_t(scene.features.size());
    // The other frame has the same sizes.
    scene.landmarks.resize(120);
    scene.features.resize(200);
    return match_job(scene);
}

void add_inputs(std::vector<StageCase>& cases) {
    cases.push_back(float_case(DEFREC_STAGE_MATCH, "tracked",
                               "Features and disparity of the stages before.", tracked,
                               match_spread));
    add(cases, "plain", "Landmarks that are seen again, with some bits flipped.", {150, 180}, {});
    add(cases, "ties", "Equal distances are told apart by index.", {90, 110}, make_ties);
    add(cases, "no_features", "A frame without features after one with.", {40, 60},
        [](MatchScene& s) { s.count = 0; });
    add(cases, "one_feature", "A frame with a single feature.", {40, 60},
        [](MatchScene& s) { s.count = 1; });
    add(cases, "too_many_features", "A number beyond the parameters' is cut to it.", {40, 60},
        [](MatchScene& s) { s.count = 100000; });
    add(cases, "fewer_features", "Features behind the number are not looked at.", {80, 100},
        [](MatchScene& s) { s.count = 37; });
    add(cases, "fewer_landmarks",
        "As many landmarks as prepare was given, fewer than the parameters say.", {31, 60},
        [](MatchScene& s) { s.params.landmarks = 500; });
    add(cases, "one_landmark", "A single landmark.", {1, 70}, {});
    add(cases, "no_depth", "No valid depth anywhere: matches without position.", {80, 90},
        [](MatchScene& s) {
            s.disparity.assign(s.disparity.size(), int16_t(DEFREC_DISPARITY_NONE));
        });
    add(cases, "zero_disparity", "Disparity 0 is no depth.", {60, 70},
        [](MatchScene& s) { s.disparity.assign(s.disparity.size(), int16_t{0}); });
    add(cases, "outside", "Features outside of the image are lifted at its border.", {60, 70},
        [](MatchScene& s) {
            for (size_t i = 0; i < s.features.size(); i += 2)
                s.features[i].x = i % 4 == 0 ? -5000 : 16 * 96 + 777;
            for (size_t i = 0; i < s.features.size(); i += 3)
                s.features[i].y = i % 2 == 0 ? -1 : 16 * 72 + 3;
        });
}

void add_parameters(std::vector<StageCase>& cases) {
    add(cases, "padded_stride", "Bytes between rows are not looked at.", {60, 70},
        [](MatchScene& s) { s.params.stride = 107; });
    add(cases, "strict", "A small distance and a strict ratio.", {150, 180}, [](MatchScene& s) {
        s.params.max_distance = 20;
        s.params.ratio = 90;
    });
    add(cases, "loose", "The largest distance, no ratio test.", {90, 100},
        [](MatchScene& s) { s.params.max_distance = s.params.ratio = 256; });
    add(cases, "strictest", "The smallest distance and ratio.", {90, 100},
        [](MatchScene& s) { s.params.max_distance = s.params.ratio = 1; });
    add(cases, "largest", "As many landmarks and features as in a large frame.", {4096, 4096}, {},
        false, true);
    const auto unprepared = [](CaseRun&, uint32_t frame) {
        MatchScene scene = match_scene(90 + frame, 50, 60);
        StageJob job = match_job(scene);
        job.prepared = false;
        job.out[0].size = 0;
        return job;
    };
    cases.push_back(float_case(DEFREC_STAGE_MATCH, "unprepared",
                               "Without prepare there are no landmarks and no matches.", unprepared,
                               match_spread));
}

}  // namespace

void add_match_cases(std::vector<StageCase>& cases) {
    add_inputs(cases);
    add_parameters(cases);
}

}  // namespace defrec::conformance
