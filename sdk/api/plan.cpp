// The exported functions for plans, but for those of a job: check, catch, forward.
#include <array>

#include "sdk/api/call.hpp"
#include "sdk/api/objects.hpp"
#include "sdk/api/read.hpp"
#include "sdk/api/verdict.hpp"

using namespace defrec;

namespace {

void expect_usable(RegistrationVerdict verdict, uint32_t flags, const std::string& reason) {
    if (verdict == RegistrationVerdict::kFailed)
        fail(DEFREC_ERROR_ARGUMENT, "the registration has failed: ", reason);
    if (verdict != RegistrationVerdict::kRegistered && (flags & DEFREC_PLAN_LOOKED_AT) == 0)
        fail(DEFREC_ERROR_ARGUMENT, "the registration is not accepted: ", reason,
             "; DEFREC_PLAN_LOOKED_AT says that a person has looked at it");
}

template <class Value>
std::vector<Value> copied(const char* name, const Value* values, uint64_t count) {
    const auto given = read_array(name, values, count, 3);
    return {given.begin(), given.end()};
}

PlanData read_plan(const Registration& found, const defrec_plan_desc& desc) {
    PlanData data;
    data.verdict = found.verdict;
    data.pose = found.pose;
    data.covariance = found.covariance;
    data.vertices = copied("desc.vertices", desc.vertices, desc.vertex_count);
    data.triangles = copied("desc.triangles", desc.triangles, desc.triangle_count);
    data.targets = copied("desc.targets", desc.targets, desc.target_count);
    for (const defrec_plan_part& part : read_array("desc.parts", desc.parts, desc.part_count, 1)) {
        expect_given("a part's name", part.name);
        data.parts.push_back({part.name, part.first_triangle, part.triangle_count});
    }
    if (desc.target_names != nullptr)
        for (uint64_t i = 0; i < desc.target_count; ++i) {
            expect_given("a target's name", desc.target_names[i]);
            data.target_names.emplace_back(desc.target_names[i]);
        }
    // A point that cannot be placed is refused with the data.
    if (found.deformation.shape && data.fault().empty())
        for (size_t i = 0; i < data.point_count(); ++i) {
            const PlacedPoint point = found.placed(data.place(i));
            const std::array<double, 6> covariance = symmetric_values(point.covariance);
            data.deformed_places.insert(data.deformed_places.end(), point.place.begin(),
                                        point.place.end());
            data.deformed_covariances.insert(data.deformed_covariances.end(), covariance.begin(),
                                             covariance.end());
        }
    return data;
}

defrec_plan add(std::shared_ptr<const Plan> plan) {
    auto object = std::make_shared<PlanObject>();
    for (const PlanPart& part : plan->data().parts)
        object->parts.push_back({part.name.c_str(), part.first_triangle, part.triangle_count});
    const std::vector<std::string>& names = plan->data().target_names;
    object->target_names.assign(plan->data().targets.size() / 3, "");
    for (size_t i = 0; i < names.size(); ++i) object->target_names[i] = names[i].c_str();
    object->plan = std::move(plan);
    return add_handle<defrec_plan>(std::move(object));
}

}  // namespace

extern "C" {

defrec_status defrec_plan_create(defrec_template surface, defrec_registration registration,
                                 const defrec_plan_desc* desc, defrec_plan* out) {
    return api_call([&] {
        expect_given("out", out);
        const auto its_surface = find_handle(surface);
        const auto its_registration = find_handle(registration);
        const auto given = read_complete(desc);
        const Registration& found = its_registration->found;
        expect_usable(found.verdict, given.flags, found.reason);
        *out = add(std::make_shared<const Plan>(its_surface->surface, read_plan(found, given)));
    });
}

defrec_status defrec_plan_save(defrec_plan plan, const char* path) {
    return api_call([&] {
        const auto object = find_handle(plan);
        expect_given("path", path);
        object->plan->save(path);
    });
}

defrec_status defrec_plan_load(defrec_template surface, const char* path, defrec_plan* out) {
    return api_call([&] {
        expect_given("out", out);
        expect_given("path", path);
        *out = add(Plan::load(find_handle(surface)->surface, path));
    });
}

void defrec_plan_destroy(defrec_plan plan) {
    if (plan != nullptr) api_call([&] { remove_handle(plan); });
}

defrec_status defrec_plan_get(defrec_plan plan, defrec_plan_info* out) {
    return api_call([&] {
        const auto object = find_handle(plan);
        const PlanData& data = object->plan->data();
        defrec_plan_info info{};
        info.struct_size = sizeof info;
        info.verdict = verdict_of(data.verdict);
        write_motion(data.pose.rotation, data.pose.translation, info.transform);
        write_matrix(data.covariance, info.covariance);
        info.vertices = data.vertices.data();
        info.vertex_count = data.vertices.size() / 3;
        info.triangles = data.triangles.data();
        info.triangle_count = data.triangles.size() / 3;
        info.parts = object->parts.data();
        info.part_count = object->parts.size();
        info.targets = data.targets.data();
        info.target_count = data.targets.size() / 3;
        info.template_xyz = object->plan->at_rest().data();
        info.registration_error_mm = object->plan->registration_error_mm().data();
        info.point_count = object->plan->point_count();
        info.deformed = data.is_deformed() ? 1 : 0;
        info.target_names = object->target_names.data();
        write_struct(out, info);
    });
}

}  // extern "C"
