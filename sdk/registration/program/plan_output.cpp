// See plan_output.hpp.
#include "sdk/registration/program/plan_output.hpp"

#include <utility>

namespace defrec::cli {
namespace {

// The model's arrays as the library takes them.
struct PlanArrays {
    std::vector<std::uint32_t> triangles;
    std::vector<std::string> names;
    std::vector<defrec_plan_part> parts;
    std::vector<double> targets;
    std::vector<const char*> target_names;
};

PlanArrays arrays_of(const PlanInput& input, bool is_turned) {
    PlanArrays made;
    for (const ModelTarget& target : input.targets) {
        made.targets.insert(made.targets.end(), target.place.begin(), target.place.end());
        made.target_names.push_back(target.name.c_str());
    }
    if (input.model == nullptr) return made;
    made.triangles = input.model->triangles;
    if (is_turned)
        for (std::size_t i = 0; i + 2 < made.triangles.size(); i += 3)
            std::swap(made.triangles[i + 1], made.triangles[i + 2]);
    std::vector<MeshPart> parts = input.model->parts;
    if (parts.empty())
        parts.push_back({input.model_path.stem().string(), 0, made.triangles.size() / 3});
    for (const MeshPart& part : parts) made.names.push_back(part.name);
    for (std::size_t i = 0; i < parts.size(); ++i)
        made.parts.push_back(
            {made.names[i].c_str(), parts[i].first_triangle, parts[i].triangle_count});
    return made;
}

}  // namespace

bool write_plan(const std::filesystem::path& path, const PlanInput& input,
                RegisterFindings& findings) {
    const bool is_failed = findings.verdict == DEFREC_VERDICT_FAILED;
    if (is_failed || (!findings.is_registered() && !input.is_looked_at)) {
        findings.notes.push_back(
            "No plan was written: the model is not registered." +
            std::string(is_failed ? "" : " Once a person has looked, --looked-at writes it."));
        return false;
    }
    const PlanArrays arrays = arrays_of(input, findings.fit().model_turned != 0);
    auto desc = initialised<defrec_plan_desc>();
    if (input.is_looked_at) desc.flags = DEFREC_PLAN_LOOKED_AT;
    if (input.model != nullptr) {
        desc.vertices = input.model->vertices.data();
        desc.vertex_count = input.model->vertices.size() / 3;
    }
    desc.triangles = arrays.triangles.data();
    desc.triangle_count = arrays.triangles.size() / 3;
    desc.parts = arrays.parts.data();
    desc.part_count = arrays.parts.size();
    desc.targets = arrays.targets.data();
    desc.target_count = arrays.targets.size() / 3;
    desc.target_names = arrays.target_names.data();
    defrec_plan handle = nullptr;
    require(defrec_plan_create(input.surface.get(), findings.found.handle.get(), &desc, &handle),
            ExitCode::kInput, "making the plan");
    const Plan plan(handle);
    require(defrec_plan_save(plan.get(), path.string().c_str()), ExitCode::kOutput,
            "writing the plan");
    return true;
}

}  // namespace defrec::cli
