// Frames as OpenIGTLink messages.
#include "sdk/live_link/messages.hpp"

#include <igtlImageMessage.h>
#include <igtlPointMessage.h>
#include <igtlPolyDataMessage.h>
#include <igtlStatusMessage.h>
#include <igtlTransformMessage.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>
#include <utility>

#include "sdk/client/library.hpp"

namespace defrec::cli {
namespace {

using Colour = std::array<igtlUint8, 3>;

// The overlay's, by which status it has.
constexpr Colour kTracked{45, 212, 191}, kExtrapolated{251, 191, 36};
// The live view's.
constexpr Colour kTarget{244, 114, 255}, kPlanTarget{236, 92, 246};

constexpr std::uint64_t kNanosecondsPerSecond = 1'000'000'000;

int status_code(std::uint32_t state) {
    switch (state) {
        case DEFREC_TRACKING:
        case DEFREC_DEGRADED:
        case DEFREC_RELOCALISED:
            return igtl::StatusMessage::STATUS_OK;
        case DEFREC_INITIALISING:
            return igtl::StatusMessage::STATUS_NOT_READY;
        default:
            return igtl::StatusMessage::STATUS_NOT_FOUND;
    }
}

// Completes a message and appends its bytes.
void append(igtl::MessageBase& message, const char* device_name, const LinkFrame& frame,
            std::string& out) {
    const auto time = static_cast<std::uint64_t>(std::max<std::int64_t>(0, frame.timestamp_ns));
    // OpenIGTLink's fraction counts 2^-32 s.
    const std::uint64_t fraction = ((time % kNanosecondsPerSecond) << 32) / kNanosecondsPerSecond;
    message.SetDeviceName(device_name);
    message.SetTimeStamp(static_cast<unsigned>(time / kNanosecondsPerSecond),
                         static_cast<unsigned>(fraction));
    message.Pack();
    out.append(static_cast<const char*>(message.GetPackPointer()),
               static_cast<std::size_t>(message.GetPackSize()));
}

bool are_finite(const std::vector<float>& values) {
    return std::all_of(values.begin(), values.end(),
                       [](float value) { return std::isfinite(value); });
}

bool has_consistent_surface(const LinkFrame& frame) {
    const std::size_t count = frame.vertex_status.size();
    if (!frame.has_geometry || count == 0 || !frame.triangles || frame.triangles->empty())
        return false;
    return frame.triangles->size() % 3 == 0 && frame.vertices.size() == 3 * count &&
           frame.expected_error_mm.size() == count && frame.vertex_evidence.size() == count &&
           frame.vertex_covariance.size() == 6 * count && are_finite(frame.vertices) &&
           are_finite(frame.expected_error_mm) && are_finite(frame.vertex_covariance) &&
           std::all_of(frame.triangles->begin(), frame.triangles->end(),
                       [count](std::uint32_t vertex) { return vertex < count; });
}

// As the protocol's 20 bytes hold it: "Plan1-tumour".
std::string device_name(const LinkPart& part) {
    constexpr std::size_t kMaxBytes = 20;
    std::string name = "Plan" + std::to_string(part.place) + "-" + part.name;
    for (char& c : name)
        if (c <= ' ' || c > '~') c = '_';
    return name.substr(0, kMaxBytes);
}

std::string plan_text(const LinkPlan& plan) {
    std::string text = " parts=" + std::to_string(plan.parts.size()) +
                       " plan_targets=" + std::to_string(plan.targets.size());
    for (const LinkPart& part : plan.parts) text.append(" ").append(device_name(part));
    return text;
}

void append_status(const LinkFrame& frame, std::size_t vertices, std::string& out) {
    const std::string text =
        "reasons=" + reason_names(frame.reasons, "|") + " epoch=" + std::to_string(frame.epoch) +
        " vertices=" + std::to_string(vertices) +
        " points=" + std::to_string(frame.has_geometry ? frame.points.size() : 0) +
        " targets=" + std::to_string(frame.has_geometry ? frame.targets.size() : 0);
    const std::string plan = frame.plan ? plan_text(*frame.plan) : std::string();
    const auto message = igtl::StatusMessage::New();
    message->SetCode(status_code(frame.state));
    message->SetSubCode(frame.index);
    message->SetErrorName(state_name(frame.state));
    message->SetStatusString((text + plan).c_str());
    append(*message, "TrackingState", frame, out);
}

// Pixels of 1 x 1 at the origin: an image has no place in mm.
void append_image(const LinkFrame& frame, std::string& out) {
    const LinkImage& image = *frame.image;
    const auto message = igtl::ImageMessage::New();
    message->SetDimensions(image.width, image.height, 1);
    message->SetSpacing(1, 1, 1);
    message->SetScalarTypeToUint8();
    message->SetNumComponents(image.channels);
    message->SetSubVolume(image.width, image.height, 1, 0, 0, 0);
    message->AllocateScalars();
    auto* to = static_cast<std::uint8_t*>(message->GetScalarPointer());
    const std::size_t row_bytes =
        static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.channels);
    for (int y = 0; y < image.height; ++y, to += row_bytes) {
        const std::uint8_t* row = image.pixels + static_cast<std::size_t>(y) * image.stride;
        std::copy_n(row, row_bytes, to);
        if (image.channels == 3)  // the protocol has red first
            for (std::size_t x = 0; x < row_bytes; x += 3) std::swap(to[x], to[x + 2]);
    }
    append(*message, "LeftImage", frame, out);
}

void append_transform(const LinkFrame& frame, std::string& out) {
    igtl::Matrix4x4 matrix;
    igtl::IdentityMatrix(matrix);
    for (std::size_t i = 0; i < frame.rigid_motion.size(); ++i)
        matrix[i / 4][i % 4] = static_cast<float>(frame.rigid_motion[i]);
    const auto message = igtl::TransformMessage::New();
    message->SetMatrix(matrix);
    append(*message, "TemplateToCamera", frame, out);
}

igtl::PolyDataAttribute::Pointer point_attribute(const char* name, int type, std::size_t components,
                                                 const std::vector<float>& values) {
    auto attribute = igtl::PolyDataAttribute::New();
    attribute->SetType(type, static_cast<igtlUint32>(components));
    attribute->SetName(name);
    attribute->SetSize(static_cast<igtlUint32>(values.size() / components));
    attribute->SetData(const_cast<igtlFloat32*>(values.data()));
    return attribute;
}

igtl::PolyDataAttribute::Pointer point_scalars(const char* name, const std::vector<float>& values) {
    return point_attribute(name, igtl::PolyDataAttribute::POINT_SCALAR, 1, values);
}

// Whole 3x3 matrices, as the protocol wants tensors.
igtl::PolyDataAttribute::Pointer point_tensors(const char* name,
                                               const std::vector<float>& covariance) {
    constexpr std::size_t kPlaces[] = {0, 1, 2, 1, 3, 4, 2, 4, 5};
    std::vector<float> matrices;
    matrices.reserve(covariance.size() / 6 * std::size(kPlaces));
    for (std::size_t i = 0; i < covariance.size(); i += 6)
        for (const std::size_t place : kPlaces) matrices.push_back(covariance[i + place]);
    return point_attribute(name, igtl::PolyDataAttribute::POINT_TENSOR, std::size(kPlaces),
                           matrices);
}

igtl::PolyDataMessage::Pointer mesh_message(const std::vector<float>& vertices,
                                            const std::vector<std::uint32_t>& triangles) {
    auto points = igtl::PolyDataPointArray::New();
    for (std::size_t i = 0; i < vertices.size(); i += 3)
        points->AddPoint(vertices[i], vertices[i + 1], vertices[i + 2]);
    auto cells = igtl::PolyDataCellArray::New();
    for (std::size_t i = 0; i < triangles.size(); i += 3)
        cells->AddCell(3, const_cast<igtlUint32*>(triangles.data() + i));
    auto message = igtl::PolyDataMessage::New();
    message->SetPoints(points);
    message->SetPolygons(cells);
    return message;
}

void append_surface(const LinkFrame& frame, std::string& out) {
    const auto message = mesh_message(frame.vertices, *frame.triangles);
    const auto error = point_scalars("expected_error_mm", frame.expected_error_mm);
    const auto status =
        point_scalars("status", {frame.vertex_status.begin(), frame.vertex_status.end()});
    const auto evidence =
        point_scalars("evidence", {frame.vertex_evidence.begin(), frame.vertex_evidence.end()});
    const auto covariance = point_tensors("covariance_mm2", frame.vertex_covariance);
    message->AddAttribute(error);
    message->AddAttribute(status);
    message->AddAttribute(evidence);
    message->AddAttribute(covariance);
    append(*message, "SurfaceInCamera", frame, out);
}

std::array<float, 3> position(const LinkPoint& point) {
    return {static_cast<float>(point.xyz[0]), static_cast<float>(point.xyz[1]),
            static_cast<float>(point.xyz[2])};
}

// As the protocol's 64 bytes hold it, whole characters and the zero behind them.
std::string point_name(const LinkPoint& point) {
    constexpr std::size_t kMaxBytes = 63;
    if (point.name.empty()) return std::to_string(point.id);
    std::size_t bytes = std::min(point.name.size(), kMaxBytes);
    const auto continues = [&](std::size_t at) {
        return at < point.name.size() &&
               (static_cast<unsigned char>(point.name[at]) & 0xc0) == 0x80;
    };
    while (bytes > 0 && continues(bytes)) --bytes;
    return point.name.substr(0, bytes);
}

igtl::PointElement::Pointer point_element(const LinkPoint& point, const Colour& colour) {
    auto element = igtl::PointElement::New();
    element->SetName(point_name(point).c_str());
    element->SetGroupName(point.status);
    element->SetRGBA(colour[0], colour[1], colour[2], 255);
    element->SetPosition(position(point).data());
    element->SetRadius(static_cast<float>(point.expected_error_mm));
    return element;
}

void append_points(const LinkFrame& frame, std::string& out) {
    const auto message = igtl::PointMessage::New();
    for (const LinkPoint& point : frame.points) {
        const bool is_tracked = point.status == std::string_view("tracked");
        auto element = point_element(point, is_tracked ? kTracked : kExtrapolated);
        message->AddPointElement(element);
    }
    append(*message, "PointsInCamera", frame, out);
}

void append_targets(const LinkFrame& frame, std::string& out) {
    const auto message = igtl::PointMessage::New();
    for (const LinkTarget& target : frame.targets) {
        auto element = point_element(target, kTarget);
        message->AddPointElement(element);
    }
    append(*message, "TargetsInCamera", frame, out);
}

// A POINT has no place for a covariance.
void append_target_errors(const LinkFrame& frame, std::string& out) {
    auto points = igtl::PolyDataPointArray::New();
    auto cells = igtl::PolyDataCellArray::New();
    std::vector<float> expected_error_mm, covariance;
    for (igtlUint32 i = 0; i < frame.targets.size(); ++i) {
        const LinkTarget& target = frame.targets[i];
        points->AddPoint(position(target).data());
        cells->AddCell(1, &i);
        expected_error_mm.push_back(static_cast<float>(target.expected_error_mm));
        covariance.insert(covariance.end(), target.covariance.begin(), target.covariance.end());
    }
    const auto message = igtl::PolyDataMessage::New();
    message->SetPoints(points);
    message->SetVertices(cells);
    const auto error = point_scalars("expected_error_mm", expected_error_mm);
    const auto tensors = point_tensors("covariance_mm2", covariance);
    message->AddAttribute(error);
    message->AddAttribute(tensors);
    append(*message, "TargetErrorsInCamera", frame, out);
}

void append_plan(const LinkFrame& frame, std::string& out) {
    for (const LinkPart& part : frame.plan->parts) {
        const auto message = mesh_message(part.vertices, part.triangles);
        const auto error = point_scalars("expected_error_mm", part.expected_error_mm);
        const auto status = point_scalars("status", part.status);
        message->AddAttribute(error);
        message->AddAttribute(status);
        append(*message, device_name(part).c_str(), frame, out);
    }
    if (frame.plan->targets.empty()) return;
    const auto message = igtl::PointMessage::New();
    for (const LinkPoint& target : frame.plan->targets) {
        auto element = point_element(target, kPlanTarget);
        message->AddPointElement(element);
    }
    append(*message, "PlanTargetsInCamera", frame, out);
}

}  // namespace

std::string pack_messages(const LinkFrame& frame) {
    std::string out;
    const bool has_surface = has_consistent_surface(frame);
    append_status(frame, has_surface ? frame.vertex_status.size() : 0, out);
    if (frame.image) append_image(frame, out);
    if (!frame.has_geometry) return out;
    if (std::all_of(frame.rigid_motion.begin(), frame.rigid_motion.end(),
                    [](double value) { return std::isfinite(value); })) {
        append_transform(frame, out);
    }
    if (has_surface) append_surface(frame, out);
    if (!frame.points.empty()) append_points(frame, out);
    if (!frame.targets.empty()) {
        append_targets(frame, out);
        append_target_errors(frame, out);
    }
    if (frame.plan) append_plan(frame, out);
    return out;
}

}  // namespace defrec::cli
