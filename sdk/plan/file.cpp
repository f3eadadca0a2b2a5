// A plan as a file: a fingerprint of the template's first view, the registration, the model, its
// parts and the targets, and where a registration that deformed the model puts them.
#include "sdk/base/os/binary_file.hpp"
#include "sdk/base/util/sha256.hpp"
#include "sdk/contract/descs.hpp"
#include "sdk/plan/plan.hpp"
#include "sdk/template/template.hpp"

namespace defrec {
namespace {

constexpr BinaryFileKind kPlanFile = {
    "plan", {'d', 'e', 'f', 'r', 'e', 'c', 'P', '\n'}, 3, uint64_t{1} << 28};

template <class Value>
void add_bytes(Sha256& sum, std::span<const Value> values) {
    sum.add({reinterpret_cast<const unsigned char*>(values.data()), values.size_bytes()});
}

// Growth, cuts and bodies leave a template's first view and its camera as they are.
std::string fingerprint_of(const TemplateData& data) {
    Sha256 sum;
    add_bytes(sum, std::span(&data.width, 1));
    add_bytes(sum, std::span(&data.height, 1));
    add_bytes(sum, std::span(&data.camera, 1));
    add_bytes(sum, std::span(data.image).first(size_t{data.width} * data.height));
    return sum.hex();
}

// Call visit for every member, in the file's order; the same for reading and writing.
template <class Data, class Visit>
void visit_registration(Data& data, Visit&& visit) {
    visit(data.verdict);
    for (int row = 0; row < 3; ++row)
        for (int column = 0; column < 3; ++column) visit(data.pose.rotation(row, column));
    for (int row = 0; row < 3; ++row) visit(data.pose.translation[row]);
    for (int row = 0; row < 6; ++row)
        for (int column = 0; column < 6; ++column) visit(data.covariance(row, column));
}
template <class Data, class Visit>
void visit_arrays(Data& data, Visit&& visit) {
    visit(data.vertices);
    visit(data.triangles);
    visit(data.targets);
    visit(data.deformed_places);
    visit(data.deformed_covariances);
}

}  // namespace

void Plan::save(const char* path) const {
    BinaryWriter writer(kPlanFile);
    writer.text(fingerprint_of(surface_->data()));
    visit_registration(data_, [&](const auto& value) { writer.value(value); });
    visit_arrays(data_, [&](const auto& values) { writer.array(values); });
    writer.value(static_cast<uint64_t>(data_.parts.size()));
    for (const PlanPart& part : data_.parts) {
        writer.text(part.name);
        writer.value(part.first_triangle);
        writer.value(part.triangle_count);
    }
    writer.value(static_cast<uint64_t>(data_.target_names.size()));
    for (const std::string& name : data_.target_names) writer.text(name);
    writer.save(path);
}

std::shared_ptr<const Plan> Plan::load(std::shared_ptr<const Template> surface, const char* path) {
    BinaryReader reader(kPlanFile, path);
    const std::string made_for = reader.text();
    PlanData data;
    visit_registration(data, [&](auto& value) { reader.value(value); });
    visit_arrays(data, [&](auto& values) { reader.array(values); });
    uint64_t parts = 0;
    reader.value(parts);
    if (parts > kPlanMaxPartCount) reader.broken("its number of parts is out of range");
    for (uint64_t i = 0; i < parts; ++i) {
        PlanPart& part = data.parts.emplace_back();
        part.name = reader.text();
        reader.value(part.first_triangle);
        reader.value(part.triangle_count);
    }
    uint64_t names = 0;
    const uint64_t targets = data.targets.size() / 3;
    reader.value(names);
    if (names > targets) reader.broken("its number of names is out of range");
    for (uint64_t i = 0; i < names; ++i) data.target_names.push_back(reader.text());
    reader.expect_end();
    if (data.verdict < RegistrationVerdict::kRegistered ||
        data.verdict >= RegistrationVerdict::kFailed)
        reader.broken("its verdict is out of range");
    if (const std::string fault = data.fault(); !fault.empty()) reader.broken(fault.c_str());
    if (made_for != fingerprint_of(surface->data()))
        fail(DEFREC_ERROR_ARGUMENT, reader.path(),
             " was made for another template: the first view of the one given is not that of the "
             "plan");
    return std::make_shared<const Plan>(std::move(surface), std::move(data));
}

}  // namespace defrec
