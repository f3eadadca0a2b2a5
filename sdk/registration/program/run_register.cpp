// See run_register.hpp.
#include "sdk/registration/program/run_register.hpp"

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <utility>

#include "sdk/base/os/atomic_file.hpp"
#include "sdk/io/exit_code.hpp"
#include "sdk/io/json_text.hpp"
#include "sdk/io/output_folder.hpp"
#include "sdk/io/terminal.hpp"
#include "sdk/io/text.hpp"
#include "sdk/registration/program/doubtful_targets.hpp"
#include "sdk/registration/program/inputs.hpp"
#include "sdk/registration/program/likely_causes.hpp"
#include "sdk/registration/program/pairs_and_surface.hpp"
#include "sdk/registration/program/placed_model.hpp"
#include "sdk/registration/program/plan_output.hpp"
#include "sdk/registration/program/register_json.hpp"
#include "sdk/registration/program/register_picture.hpp"

namespace defrec::cli {
namespace {

namespace fs = std::filesystem;

constexpr const char* kJson = "registration.json";
constexpr const char* kPicture = "registration.png";
constexpr const char* kModel = "model.ply";
constexpr const char* kTargets = "targets.csv";

void check_options(const RegisterOptions& options) {
    const auto refuse = [](const std::string& message) {
        throw CliError(ExitCode::kUsage, message);
    };
    const bool has_template = !options.seen_template.empty();
    if (options.surface.empty() && options.pairs.empty() && !has_template)
        refuse("give what was seen as --surface F or --template F, as --pairs F, or both.");
    if (!options.surface.empty() && has_template)
        refuse("the template is a surface that was seen; give either --surface or --template.");
    if (options.surface.empty() != options.model.empty() && !has_template &&
        !options.is_by_pairs_alone)
        refuse("a surface is compared with a model: give both --model F and --surface F.");
    if (!options.start.empty() && !options.pairs.empty())
        refuse("the pairs say where the search begins; give either --start or --pairs.");
    if (options.start.empty() && options.pairs.empty())
        refuse("give about where the model lies, as --start F or --pairs F.");
    if (options.model.empty() && options.pairs.empty())
        refuse("a template is compared with a model: give --model F, or pairs as --pairs F.");
    if (options.deformation_mm && !options.is_deformed)
        refuse("--deformation says how far a model may be deformed: give --deform as well.");
    if (options.is_deformed && (options.model.empty() || options.is_by_pairs_alone))
        refuse(
            "--deform draws a model to a surface: give --model F and what was seen as --surface F "
            "or --template F.");
    if (options.is_by_pairs_alone && options.pairs.empty())
        refuse("--pairs-only registers by pairs: give --pairs F.");
    if (options.plan.empty()) {
        if (options.is_looked_at) refuse("--looked-at is said of a plan: give --plan F.");
        return;
    }
    if (!has_template)
        refuse(
            "a plan belongs to a template: give what was seen as --template F, which "
            "`defrec track --save-template F` writes.");
    if (options.model.empty() && options.targets.empty())
        refuse("the plan would be empty: give --model F, --targets F, or both.");
}

bool compares_surfaces(const RegisterOptions& options) {
    return !options.is_by_pairs_alone &&
           (!options.surface.empty() || (!options.seen_template.empty() && !options.model.empty()));
}

Context open_library(const RegisterOptions& options) {
    ContextOptions library;
    library.threads = options.threads;
    library.has_plugins = false;
    return open_context(library);
}

std::vector<fs::path> inputs_of(const RegisterOptions& options) {
    std::vector<fs::path> inputs;
    for (const std::string& name : {options.model, options.surface, options.seen_template,
                                    options.pairs, options.targets, options.start})
        if (!name.empty()) inputs.emplace_back(name);
    return inputs;
}

MeshFile read_model(const RegisterOptions& options) {
    MeshFile file = read_mesh_file(options.model);
    to_millimetres(file, options.unit, options.model);
    return file;
}

// Surfaces that were compared, for the picture and the plan.
struct Compared {
    std::optional<MeshFile> model;  // all of it
    SurfaceFile surface;
};

void add_notes(const std::vector<std::string>& notes, RegisterFindings& findings) {
    findings.notes.insert(findings.notes.end(), notes.begin(), notes.end());
}

// The part whose surface is seen; the others become targets: their middles.
MeshFile seen_part(const MeshFile& file, const RegisterOptions& options,
                   RegisterFindings& findings) {
    add_notes(file.notes, findings);
    if (file.parts.size() <= 1 && options.part.empty()) return file;
    if (options.part.empty()) {
        std::string names;
        for (const MeshPart& part : file.parts)
            names += (names.empty() ? "" : ", ") + printable(part.name);
        throw CliError(ExitCode::kUsage,
                       options.model + ": the model has the parts " + names +
                           "; name the one whose surface is seen as --part NAME.");
    }
    for (const MeshPart& part : file.parts) {
        if (part.name == options.part) continue;
        const MeshFile other = file.part(part.name);
        std::array<double, 3> sum{};
        for (const std::uint32_t vertex : other.triangles)
            for (std::size_t axis = 0; axis < 3; ++axis)
                sum[axis] += double{other.vertices[3 * std::size_t{vertex} + axis]};
        for (double& value : sum) value /= static_cast<double>(other.triangles.size());
        findings.targets.push_back({part.name, sum});
    }
    return file.part(options.part);
}

void note_findings(const defrec_registration_info& info, std::vector<std::string>& notes) {
    if (info.model_turned != 0)
        notes.emplace_back("The model was inside out: its triangles were turned.");
    if (info.dropped_triangles > 0)
        notes.push_back(std::to_string(info.dropped_triangles) +
                        " triangles of the model have no area and were left out.");
    if (info.open_edges > 0)
        notes.push_back("The model is not closed: " + std::to_string(info.open_edges) +
                        " edges have one triangle. It may be cut short.");
    if (info.odd_edges > 0)
        notes.push_back(std::to_string(info.odd_edges) +
                        " edges of the model have more than two triangles, or two that turn "
                        "differently.");
    if (info.model_has_outside == 0)
        notes.emplace_back(
            "The model does not say where its outside is: its back may be taken for its front.");
}

void note_surface(const SurfaceFile& surface, std::vector<std::string>& notes) {
    if (surface.left_out > 0)
        notes.push_back(std::to_string(surface.left_out) +
                        " points of the surface were not observed and were left out.");
    if (surface.error_column.empty())
        notes.emplace_back("The surface's points have no errors; they count alike.");
}

SurfaceFile surface_of(const Template& seen) {
    const defrec_template_info info = info_of(seen);
    SurfaceFile surface;
    for (std::uint64_t i = 0; i < info.vertex_count; ++i)
        surface.places.insert(surface.places.end(), info.vertices[i].position,
                              info.vertices[i].position + 3);
    return surface;
}

// Adds what pairs say of a surface that was compared.
void add_pairs(const RegisterOptions& options, const SurfaceEvidence& surface,
               const PairsEvidence& pairs, RegisterFindings& findings) {
    for (std::size_t i = 0; i < pairs.counts.size(); ++i)
        if (pairs.counts[i] == 0)
            findings.notes.push_back("Pair " + std::to_string(pairs.all.ids[i]) +
                                     " contradicts the others and was left out.");
    if (findings.verdict == DEFREC_VERDICT_FAILED) return;
    Together both;
    // A body that has changed its shape has no pose that pairs could share.
    if (!options.is_deformed) both = together(findings.found, surface, pairs, options);
    if (both.is_contradiction) {
        findings.verdict = DEFREC_VERDICT_FAILED;
        findings.reason = both.reason;
    } else if (both.by_both.handle) {
        findings.take(std::move(both.by_both));
        findings.compared = std::move(both.by_surface);
        findings.reason = both.reason;
        findings.method = "surface and pairs";
    } else if (findings.verdict == DEFREC_VERDICT_UNDETERMINED) {
        findings.reason += ". The pairs alone hold this to " +
                           held(findings.found, pairs.all, pairs.alone) +
                           ": give --pairs-only to register by them";
    }
}

// seen: null where a file has the surface; pairs: null where there are none.
Compared compare(const RegisterOptions& options, const Transform& start, const Context& context,
                 const Template& seen, const PairsEvidence* pairs, RegisterFindings& findings) {
    Compared compared;
    compared.model = read_model(options);
    const MeshFile part = seen_part(*compared.model, options, findings);
    compared.surface = seen ? surface_of(seen) : read_surface_file(options.surface);
    const SurfaceInput input{part, compared.surface, seen};
    findings.take(register_by_surface(context, input, start, options));
    note_findings(findings.info(), findings.notes);
    if (!seen) note_surface(compared.surface, findings.notes);
    findings.method = "surface";
    if (pairs == nullptr) return compared;
    const SurfaceEvidence surface{compared.surface.places, [&](const Transform& at) {
                                      RegisterOptions near = options;
                                      near.starts = 1;
                                      near.start_turn_degrees = near.start_shift_mm = 0;
                                      return register_by_surface(context, input, at, near);
                                  }};
    add_pairs(options, surface, *pairs, findings);
    findings.pairs = pair_findings(findings.found, *pairs);
    return compared;
}

// By the pairs alone, each with its residual.
void take_pairs(const PairsFile& file, Registered by_pairs, RegisterFindings& findings) {
    findings.take(std::move(by_pairs));
    findings.method = "pairs";
    for (std::size_t i = 0; i < file.ids.size(); ++i)
        findings.pairs.push_back(
            {file.ids[i], double{findings.info().residuals[i]}, findings.info().inliers[i] != 0});
}

// Beside the registration, whose file names it.
void make_plan(const RegisterOptions& options, const Template& seen, const Compared& compared,
               const std::vector<ModelTarget>& targets, RegisterFindings& findings) {
    const PlanInput input{seen, compared.model ? &*compared.model : nullptr, options.model, targets,
                          options.is_looked_at};
    if (!write_plan(options.plan, input, findings)) return;
    findings.plan = options.plan;
    for (const ModelTarget& target : targets) findings.plan_targets.push_back(target.name);
}

Template seen_template(const Context& context, const std::string& path) {
    try {
        return load_template(context, path);
    } catch (const CliError& error) {
        const fs::path ending = fs::path(path).extension();
        if (ending != ".ply" && ending != ".csv") throw;
        throw CliError(error.code(),
                       std::string(error.what()) +
                           " A surface that was seen, as template.ply is one, goes to --surface.");
    }
}

Transform start_of(const std::string& path, std::vector<std::string>& notes) {
    const PoseFile file = read_pose_file(path);
    if (!file.verdict.empty() && file.verdict != name_of_verdict(DEFREC_VERDICT_ACCEPTED))
        notes.push_back("The registration that the search begins with, " + path +
                        ", has the verdict " + printable(file.verdict) +
                        ": it may lie far from the true one.");
    return file.pose;
}

// Whatever units and axes tell of a registration that there is not.
void add_causes(const RegisterOptions& options, const Compared& compared, const PairsFile& pairs,
                RegisterFindings& findings) {
    GivenPlaces given;
    std::optional<MeshFile> part;
    if (compared.model)
        part = options.part.empty() ? *compared.model : compared.model->part(options.part);
    if (part) given.model = &*part;
    given.surface = compared.surface.places;
    if (!options.pairs.empty()) given.pairs = &pairs;
    add_notes(likely_causes(given), findings);
}

// Targets of the file: a registration holds, wherever they are.
void add_doubts(const RegisterOptions& options, const Compared& compared, const PairsFile& pairs,
                const std::vector<ModelTarget>& targets, RegisterFindings& findings) {
    if (targets.empty() || findings.verdict == DEFREC_VERDICT_FAILED) return;
    const auto add = [&](std::string note) {
        if (!note.empty()) findings.notes.push_back(std::move(note));
    };
    add(doubtful_targets({targets, compared.model ? &*compared.model : nullptr,
                          options.pairs.empty() ? nullptr : &pairs, findings.found.transform()}));
    if (!options.is_tracked_camera) return;
    std::vector<std::array<double, 3>> places;
    for (const ModelTarget& target : targets) places.push_back(moved(findings, target).place);
    add(targets_behind_camera(targets, places));
}

// Files that are wrong leave no folder behind.
void write_outputs(const RegisterFindings& findings, const Compared& compared, bool is_deformed,
                   const OutputFolder& out, const std::string& json) {
    if (!compared.surface.places.empty()) {
        const PlacedModel placed = placed_model(findings, *compared.model);
        write_register_picture(out / kPicture,
                               {placed.xyz, compared.surface.places, &findings.fit(),
                                name_of_verdict(findings.verdict)});
        if (is_deformed) {
            write_model(out / kModel, placed, *compared.model);
            write_targets(out / kTargets, findings);
        }
    }
    write_atomically(out / kJson, json);
}

}  // namespace

int run_register(const RegisterOptions& options) {
    check_options(options);
    keep_apart(inputs_of(options),
               {fs::path(options.out) / kJson, fs::path(options.out) / kPicture,
                fs::path(options.out) / kModel, fs::path(options.out) / kTargets, options.plan});
    RegisterFindings findings;
    const Context context = open_library(options);
    Template seen;
    if (!options.seen_template.empty()) seen = seen_template(context, options.seen_template);
    Transform start{};
    if (!options.start.empty()) start = start_of(options.start, findings.notes);
    std::optional<PairsEvidence> pairs;
    PairsFile file;
    if (!options.pairs.empty()) {
        file = read_pairs_file(options.pairs);
        take_pairs(file, register_by_pairs(file, options), findings);
        if (compares_surfaces(options)) {
            pairs = evidence_of(file, options);
            start = pairs->alone.transform();
        }
    }
    // Pairs that contradict each other, or leave a motion open, give no start.
    const bool has_start = !pairs || pairs->alone.is_accepted();
    Compared compared;
    if (compares_surfaces(options) && has_start)
        compared = compare(options, start, context, seen, pairs ? &*pairs : nullptr, findings);
    if (options.is_by_pairs_alone && !options.model.empty()) {
        compared.model = read_model(options);
        add_notes(compared.model->notes, findings);
    }
    if (compares_surfaces(options) && !has_start)
        findings.notes.emplace_back("The surface was not looked at: the pairs give no start.");
    if (!findings.is_registered()) add_causes(options, compared, file, findings);
    std::vector<ModelTarget> targets;
    if (!options.targets.empty()) targets = read_model_targets(options.targets);
    findings.targets.insert(findings.targets.end(), targets.begin(), targets.end());
    add_doubts(options, compared, file, targets, findings);
    const OutputFolder out(options.out);
    for (const char* name : {kJson, kPicture, kModel, kTargets}) out.forget(name);
    if (!options.plan.empty()) make_plan(options, seen, compared, targets, findings);
    const std::string json = json_text(register_json(findings), 2) + "\n";
    write_outputs(findings, compared, options.is_deformed, out, json);
    if (!options.quiet) print(options.json ? json : register_text(findings));
    return static_cast<int>(findings.is_registered() ? ExitCode::kOk : ExitCode::kFound);
}

}  // namespace defrec::cli
