// Stage ransac: by tolerance, but for the choice of references.
#include <limits>

#include "conformance/cases/stage/stage_case.hpp"
#include "conformance/scenes/template_jobs.hpp"

namespace defrec::conformance {
namespace {

using Change = std::function<void(RansacScene&)>;

struct Options {
    uint32_t count = 200;
    double outliers = 0.3, degrees = 25;
    bool smoke = true;
};

void add(std::vector<StageCase>& cases, const char* name, const char* title, const Options& o,
         const Change& change = {}) {
    const auto make = [=](CaseRun&, uint32_t frame) {
        RansacScene scene = ransac_scene(300 + frame, o.count, o.outliers, o.degrees);
        if (change) change(scene);
        return ransac_job(scene);
    };
    cases.push_back(float_case(DEFREC_STAGE_RANSAC, name, title, make, ransac_spread, o.smoke));
}

void add_inputs(std::vector<StageCase>& cases) {
    add(cases, "plain", "Most matches are right.", {});
    add(cases, "many_outliers", "Most matches are wrong.", {.outliers = 0.7});
    add(cases, "all_outliers", "No match is right: no reference is accepted.", {.outliers = 1});
    add(cases, "no_outliers", "Every match is right.", {.outliers = 0});
    add(cases, "half_turn", "A rotation by nearly half a turn.", {.degrees = 175});
    add(cases, "no_turn", "No rotation at all.", {.degrees = 0});
    add(cases, "thousand", "A thousand matches.", {.count = 1000, .outliers = 0.5, .smoke = false});
    for (const auto& [name, title, count] :
         {std::tuple{"none", "No landmarks at all.", 0u},
          {"one", "A single match.", 1u},
          {"seven", "As many matches as support asks for, and one more.", 7u}})
        add(cases, name, title, {.count = count, .outliers = 0},
            [](RansacScene& s) { s.params.landmarks = 50; });
    add(cases, "no_matches", "Landmarks of which none is matched.", {}, [](RansacScene& s) {
        for (defrec_match& match : s.matches) match.feature = -1;
    });
    add(cases, "no_depth", "Matches without depth take no part.", {}, [](RansacScene& s) {
        for (size_t i = 0; i < s.matches.size(); i += 3) {
            s.matches[i].weight = 0;
            for (float& value : s.matches[i].position) value = 0;
        }
    });
    add(cases, "some_unmatched", "Landmarks without a match keep what was given.", {},
        [](RansacScene& s) {
            for (size_t i = 0; i < s.matches.size(); i += 2) s.matches[i].feature = -1;
        });
    add(cases, "not_finite", "Matches with numbers that are not finite take no part.", {},
        [](RansacScene& s) {
            const float bad[] = {std::numeric_limits<float>::quiet_NaN(),
                                 std::numeric_limits<float>::infinity(),
                                 -std::numeric_limits<float>::infinity(), 3e6f};
            for (size_t i = 0; i < s.matches.size(); i += 9)
                s.matches[i].position[i % 3] = bad[i / 9 % 4];
            for (size_t i = 4; i < s.matches.size(); i += 31) s.matches[i].weight = bad[0];
            for (size_t i = 5; i < s.landmarks.size(); i += 17)
                s.landmarks[i].position[i % 3] = bad[i % 4];
        });
    const auto line = [](CaseRun&, uint32_t frame) {
        RansacScene scene = ransac_scene(320 + frame, 60, 0, 0);
        for (size_t i = 0; i < scene.matches.size(); ++i)
            for (int k = 0; k < 3; ++k) {
                scene.landmarks[i].position[k] = float(k == 2 ? 80 + i : i);
                scene.matches[i].position[k] =
                    scene.landmarks[i].position[k] + float(k) + (i % 4 == 0 ? 9.0f : 0.0f);
            }
        return ransac_job(scene);
    };
    cases.push_back(
        float_case(DEFREC_STAGE_RANSAC, "line",
                   "Points on a line: their weights, though any rotation about it will do.", line,
                   ransac_weight_spread));
}

void add_parameters(std::vector<StageCase>& cases) {
    add(cases, "default_threshold", "The threshold follows from the points.", {},
        [](RansacScene& s) { s.params.threshold_mm = 0; });
    add(cases, "small_threshold", "A threshold of half a millimetre.", {},
        [](RansacScene& s) { s.params.threshold_mm = 0.5f; });
    add(cases, "one_reference", "A single reference.", {},
        [](RansacScene& s) { s.params.references = 1; });
    add(cases, "most_references", "More references than matches.", {.count = 100},
        [](RansacScene& s) { s.params.references = 1024; });
    add(cases, "one_iteration", "A single iteration.", {},
        [](RansacScene& s) { s.params.iterations = 1; });
    add(cases, "most_iterations", "As many iterations as can be.", {.count = 80, .smoke = false},
        [](RansacScene& s) { s.params.iterations = 100; });
    add(cases, "min_support", "More support asked for than there is.", {},
        [](RansacScene& s) { s.params.min_support = 190; });
    add(cases, "seed", "Another seed, with all its bits.", {},
        [](RansacScene& s) { s.params.seed = 0xfedcba9876543210; });
}

// The result may take the place of the matches it comes from.
void run_in_place(CaseRun& run) {
    Session& session = run.subject();
    const StageJob job = ransac_job(ransac_scene(330, 200, 0.3, 25));
    Queue queue(session);
    std::vector<Buffer> landmarks, matches;
    landmarks.push_back(Buffer(session, job.prepare[0].bytes.size()));
    matches.push_back(Buffer(session, job.in[0].bytes.size()));
    const Buffer summary(session, sizeof(defrec_ransac_summary));
    queue.write(landmarks[0], job.prepare[0].bytes);
    queue.write(matches[0], job.in[0].bytes);
    Stage stage(session, DEFREC_STAGE_RANSAC, job.params.get());
    stage.prepare(queue, landmarks);
    defrec_pbuffer* const in[] = {matches[0].get()};
    defrec_pbuffer* const out[] = {matches[0].get(), summary.get()};
    session.check(
        "enqueue of ransac in place",
        session.stage_table(DEFREC_STAGE_RANSAC).enqueue(stage.get(), queue.get(), in, 1, out, 2));
    std::vector<Bytes> found = {Bytes(matches[0].size()), Bytes(summary.size())};
    queue.read(matches[0], found[0]);
    queue.read(summary, found[1]);
    queue.finish();
    for (const Bytes& output : found) run.digest(output);
    Spread distances;
    ransac_spread(job, run_plainly(run.reference(), job), found, distances);
    distances.measure(run);
}

}  // namespace

void add_ransac_in_place_case(std::vector<Case>& cases) {
    Case one{"stage/ransac/in_place",
             "stage",
             "ransac",
             "The result may be the memory of the matches.",
             true,
             false,
             {}};
    one.body = [](CaseRun& run) {
        run.subject().stage_table(DEFREC_STAGE_RANSAC);
        run_in_place(run);
    };
    cases.push_back(std::move(one));
}

void add_ransac_cases(std::vector<StageCase>& cases) {
    add_inputs(cases);
    add_parameters(cases);
}

}  // namespace defrec::conformance
