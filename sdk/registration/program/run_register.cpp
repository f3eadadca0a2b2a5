// See run_register.hpp.
#include "sdk/registration/program/run_register.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <numbers>

#include "sdk/base/os/atomic_file.hpp"
#include "sdk/base/os/services.hpp"
#include "sdk/base/util/error.hpp"
#include "sdk/io/exit_code.hpp"
#include "sdk/io/json_text.hpp"
#include "sdk/io/output_folder.hpp"
#include "sdk/io/terminal.hpp"
#include "sdk/io/text.hpp"
#include "sdk/registration/model_surface.hpp"
#include "sdk/registration/point_pairs.hpp"
#include "sdk/registration/program/inputs.hpp"
#include "sdk/registration/program/register_json.hpp"
#include "sdk/registration/program/register_picture.hpp"
#include "sdk/registration/surface_registration.hpp"

namespace defrec::cli {
namespace {

namespace fs = std::filesystem;

constexpr const char* kJson = "registration.json";
constexpr const char* kPicture = "registration.png";
constexpr double kDegree = std::numbers::pi / 180;

void check_options(const RegisterOptions& options) {
    const auto refuse = [](const std::string& message) {
        throw CliError(ExitCode::kUsage, message);
    };
    if (options.surface.empty() && options.pairs.empty())
        refuse("give what was seen as --surface F, --pairs F, or both.");
    if (options.surface.empty() != options.model.empty())
        refuse("a surface is compared with a model: give both --model F and --surface F.");
    if (!options.start.empty() && !options.pairs.empty())
        refuse("the pairs say where the search begins; give either --start or --pairs.");
    if (!options.surface.empty() && options.start.empty() && options.pairs.empty())
        refuse("give about where the model lies, as --start F or --pairs F.");
}

std::vector<fs::path> inputs_of(const RegisterOptions& options) {
    std::vector<fs::path> inputs;
    for (const std::string& name :
         {options.model, options.surface, options.pairs, options.targets, options.start})
        if (!name.empty()) inputs.emplace_back(name);
    return inputs;
}

// What the library says of an input, as the program's own error.
template <class Function>
auto with_file(const std::string& path, const Function& function) {
    try {
        return function();
    } catch (const Error& error) {
        throw CliError(ExitCode::kInput, path + ": " + error.what() + ".");
    }
}

// The part whose surface is seen; the others become targets: their middles.
MeshFile load_model(const RegisterOptions& options, RegisterFindings& findings) {
    MeshFile file = read_mesh_file(options.model);
    to_millimetres(file, options.unit, options.model);
    findings.notes = file.notes;
    if (file.parts.empty() && options.part.empty()) return file;
    if (options.part.empty()) {
        std::string names;
        for (const MeshPart& part : file.parts)
            names += (names.empty() ? "" : ", ") + printable(part.name);
        throw CliError(ExitCode::kUsage,
                       options.model + ": the model has the parts " + names +
                           "; name the one whose surface is seen as --part NAME.");
    }
    MeshFile seen = file.part(options.part);
    for (const MeshPart& part : file.parts) {
        if (part.name == options.part) continue;
        const MeshFile other = file.part(part.name);
        Eigen::Vector3d sum = Eigen::Vector3d::Zero();
        for (const std::uint32_t vertex : other.triangles)
            sum += Eigen::Map<const Eigen::Vector3f>(&other.vertices[3 * std::size_t{vertex}])
                       .cast<double>();
        findings.targets.push_back({part.name, sum / static_cast<double>(other.triangles.size())});
    }
    return seen;
}

void note_findings(const ModelSurface& model, std::vector<std::string>& notes) {
    const ModelFindings& found = model.findings();
    if (found.was_turned)
        notes.emplace_back("The model was inside out: its triangles were turned.");
    if (found.dropped_triangles > 0)
        notes.push_back(std::to_string(found.dropped_triangles) +
                        " triangles of the model have no area and were left out.");
    if (found.open_edges > 0)
        notes.push_back("The model is not closed: " + std::to_string(found.open_edges) +
                        " edges have one triangle. It may be cut short.");
    if (found.odd_edges > 0)
        notes.push_back(std::to_string(found.odd_edges) +
                        " edges of the model have more than two triangles, or two that turn "
                        "differently.");
    if (!model.has_outside())
        notes.emplace_back(
            "The model does not say where its outside is: its back may be taken for its front.");
}

SurfaceOptions surface_options(const RegisterOptions& given, const Pose& start) {
    SurfaceOptions options;
    options.start = start;
    if (given.start_turn_degrees) options.start_turn = *given.start_turn_degrees * kDegree;
    if (given.start_shift_mm) options.start_shift_mm = *given.start_shift_mm;
    if (given.starts) options.starts = *given.starts;
    if (given.point_error_mm) options.point_error_mm = *given.point_error_mm;
    if (given.model_error_mm) options.model_error_mm = *given.model_error_mm;
    if (given.max_residual_mm) options.max_residual_mm = *given.max_residual_mm;
    if (given.max_error_mm) options.max_error_mm = *given.max_error_mm;
    if (!given.is_tracked_camera) options.viewer.reset();
    return options;
}

Registration by_pairs(const RegisterOptions& options, RegisterFindings& findings) {
    const PairsFile file = read_pairs_file(options.pairs);
    PairOptions limits;
    if (options.max_error_mm) limits.max_error_mm = *options.max_error_mm;
    if (options.max_residual_mm) limits.max_residual_mm = *options.max_residual_mm;
    findings.method = "pairs";
    findings.pair_ids = file.ids;
    return with_file(options.pairs, [&] { return register_pairs(file.pairs, limits); });
}

// What was compared, for the picture.
struct Compared {
    std::optional<ModelSurface> model;
    SurfaceFile surface;
};

Compared by_surface(const RegisterOptions& options, const Pose& start, RegisterFindings& findings) {
    Compared compared;
    const MeshFile mesh = load_model(options, findings);
    with_file(options.model,
              [&] { compared.model.emplace(mesh.vertices, mesh.triangles, "the model"); });
    note_findings(*compared.model, findings.notes);
    compared.surface = read_surface_file(options.surface);
    const SurfaceFile& surface = compared.surface;
    if (surface.left_out > 0)
        findings.notes.push_back(std::to_string(surface.left_out) +
                                 " points of the surface were not observed and were left out.");
    if (surface.error_column.empty())
        findings.notes.emplace_back("The surface's points have no errors; they count alike.");
    defrec_context_desc desc{};
    desc.threads = options.threads;
    const Services services(desc);
    findings.registration = with_file(options.surface, [&] {
        return register_surface(*compared.model,
                                {surface.places, surface.normals, surface.covariances},
                                surface_options(options, start), &services);
    });
    findings.method = "surface";
    findings.pair_ids.clear();
    return compared;
}

// Files that are wrong leave no folder behind.
void write_outputs(const RegisterOptions& options, const RegisterFindings& findings,
                   const Compared& compared, const std::string& json) {
    const OutputFolder out(options.out);
    write_atomically(out / kJson, json);
    if (compared.model)
        write_register_picture(out / kPicture,
                               {compared.model->vertices(), compared.model->triangles(),
                                compared.surface.places, &findings.registration});
}

}  // namespace

int run_register(const RegisterOptions& options) {
    check_options(options);
    const fs::path out(options.out);
    for (const fs::path& input : inputs_of(options))
        keep_input(input, {out / kJson, out / kPicture});
    RegisterFindings findings;
    Pose start;
    if (!options.start.empty()) start = read_pose_file(options.start);
    if (!options.pairs.empty()) {
        findings.registration = by_pairs(options, findings);
        start = findings.registration.pose;
    }
    // Pairs that contradict each other, or leave a motion open, give no start.
    const bool has_start =
        options.pairs.empty() || findings.registration.verdict == RegistrationVerdict::kRegistered;
    Compared compared;
    if (!options.surface.empty() && has_start) compared = by_surface(options, start, findings);
    if (!has_start && !options.surface.empty())
        findings.notes.emplace_back("The surface was not looked at: the pairs give no start.");
    if (!options.targets.empty())
        for (ModelTarget& target : read_model_targets(options.targets))
            findings.targets.push_back(std::move(target));
    const std::string json = json_text(register_json(findings), 2) + "\n";
    write_outputs(options, findings, compared, json);
    if (!options.quiet) print(options.json ? json : register_text(findings));
    return static_cast<int>(findings.registration.verdict == RegistrationVerdict::kRegistered
                                ? ExitCode::kOk
                                : ExitCode::kFound);
}

}  // namespace defrec::cli
