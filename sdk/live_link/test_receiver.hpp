// For tests: frames as OpenIGTLink's own classes unpack them, with every checksum verified.
#pragma once

#include <igtlImageMessage.h>
#include <igtlMessageHeader.h>
#include <igtlPointMessage.h>
#include <igtlPolyDataMessage.h>
#include <igtlSocket.h>
#include <igtlStatusMessage.h>
#include <igtlTransformMessage.h>

#include <cstring>
#include <functional>
#include <list>
#include <map>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "sdk/live_link/frame.hpp"

namespace defrec::cli {

struct ReceivedPoint {
    std::string name, group;
    float xyz[3] = {};
    float radius = 0;
    igtlUint8 colour[4] = {};
};

struct ReceivedMesh {
    std::vector<float> vertices, expected_error_mm, status, evidence;
    std::vector<float> covariance;  // 3x3 each
    std::vector<std::uint32_t> triangles;
};

struct ReceivedFrame : ReceivedMesh {
    std::vector<std::string> messages;  // "TYPE device name", in the order of arrival
    std::vector<unsigned> versions;
    unsigned seconds = 0, fraction = 0;  // the same in every message
    int code = 0;
    std::int64_t index = 0;
    std::string state, text;
    igtl::Matrix4x4 matrix = {};
    std::vector<ReceivedPoint> points, targets, plan_targets;
    std::vector<ReceivedMesh> parts;  // of a plan
    int image_size[3] = {};           // px, px, 1
    int components = 0;
    std::vector<std::uint8_t> pixels;
    std::vector<float> target_positions, target_error_mm;  // of the second of their messages
    std::vector<float> target_covariance;                  // 3x3 each
};

// Reads exactly `size` bytes; false at the end of the stream.
using ReadBytes = std::function<bool(void* data, std::size_t size)>;

inline ReadBytes from_text(const std::string& text) {
    return [&text, at = std::size_t{0}](void* data, std::size_t size) mutable {
        if (text.size() - at < size) return false;
        std::memcpy(data, text.data() + at, size);
        at += size;
        return true;
    };
}

inline ReadBytes from_socket(igtl::Socket& socket) {
    return [&socket](void* data, std::size_t size) {
        return socket.Receive(data, static_cast<int>(size)) == static_cast<int>(size);
    };
}

class FrameReader {
  public:
    explicit FrameReader(ReadBytes read) : read_(std::move(read)) {}

    // A frame begins with STATUS and ends where the next begins. Empty at the end of the stream.
    // Throws for anything that is not a whole, undamaged message.
    std::optional<ReceivedFrame> next() {
        if (!next_header_) next_header_ = read_header();
        if (!next_header_) return std::nullopt;
        ReceivedFrame frame;
        do {
            unpack(*next_header_, frame);
            next_header_ = read_header();
        } while (next_header_ && std::strcmp((*next_header_)->GetDeviceType(), "STATUS") != 0);
        return frame;
    }

    // The frame whose messages the last of a whole stream are.
    ReceivedFrame last() {
        std::optional<ReceivedFrame> last;
        while (auto frame = next()) last = std::move(frame);
        if (!last) throw std::runtime_error("no frame came");
        return *last;
    }

  private:
    std::optional<igtl::MessageHeader::Pointer> read_header() {
        auto header = igtl::MessageHeader::New();
        header->InitPack();
        if (!read_(header->GetPackPointer(), static_cast<std::size_t>(header->GetPackSize())))
            return std::nullopt;
        const auto* bytes = static_cast<const unsigned char*>(header->GetPackPointer());
        version_ = bytes[0] * 256U + bytes[1];
        header->Unpack();
        return header;
    }

    template <typename Message>
    typename Message::Pointer read_body(igtl::MessageHeader::Pointer header) {
        auto message = Message::New();
        message->SetMessageHeader(header);
        message->AllocatePack();
        if (!read_(message->GetPackBodyPointer(),
                   static_cast<std::size_t>(message->GetPackBodySize()))) {
            throw std::runtime_error("the stream ends within a message");
        }
        constexpr int kVerifyChecksum = 1;
        if ((message->Unpack(kVerifyChecksum) & igtl::MessageHeader::UNPACK_BODY) == 0) {
            throw std::runtime_error("a message is damaged");
        }
        return message;
    }

    void unpack(igtl::MessageHeader::Pointer header, ReceivedFrame& frame) {
        const std::string type = header->GetDeviceType(), name = header->GetDeviceName();
        unsigned seconds = 0, fraction = 0;
        header->GetTimeStamp(&seconds, &fraction);
        if (frame.messages.empty()) {
            frame.seconds = seconds;
            frame.fraction = fraction;
        } else if (frame.seconds != seconds || frame.fraction != fraction) {
            throw std::runtime_error("the messages of a frame differ in time");
        }
        frame.versions.push_back(version_);
        frame.messages.push_back(type + " " + name);
        if (type == "STATUS") {
            const auto message = read_body<igtl::StatusMessage>(header);
            frame.code = message->GetCode();
            frame.index = message->GetSubCode();
            frame.state = message->GetErrorName();
            frame.text = message->GetStatusString();
        } else if (type == "IMAGE") {
            const auto message = read_body<igtl::ImageMessage>(header);
            message->GetDimensions(frame.image_size);
            frame.components = message->GetNumComponents();
            const auto* pixels = static_cast<const std::uint8_t*>(message->GetScalarPointer());
            frame.pixels.assign(pixels, pixels + message->GetImageSize());
        } else if (type == "TRANSFORM") {
            read_body<igtl::TransformMessage>(header)->GetMatrix(frame.matrix);
        } else if (type == "POLYDATA") {
            const auto message = read_body<igtl::PolyDataMessage>(header);
            if (name == "TargetErrorsInCamera")
                unpack_target_errors(*message, frame);
            else
                unpack_mesh(*message,
                            name.starts_with("Plan") ? frame.parts.emplace_back() : frame);
        } else if (type == "POINT") {
            unpack_points(*read_body<igtl::PointMessage>(header),
                          name == "TargetsInCamera"       ? frame.targets
                          : name == "PlanTargetsInCamera" ? frame.plan_targets
                                                          : frame.points);
        } else {
            throw std::runtime_error("there is no message of type '" + type + "'");
        }
    }

    static std::vector<float> positions(igtl::PolyDataMessage& message) {
        std::vector<float> all;
        const auto points = message.GetPoints();
        for (int i = 0; i < points->GetNumberOfPoints(); ++i) {
            float xyz[3];
            points->GetPoint(static_cast<unsigned>(i), xyz);
            all.insert(all.end(), xyz, xyz + 3);
        }
        return all;
    }

    // By name.
    static std::map<std::string, std::vector<float>> attributes(igtl::PolyDataMessage& message) {
        std::map<std::string, std::vector<float>> all;
        for (int i = 0; i < message.GetNumberOfAttributes(); ++i) {
            igtl::PolyDataAttribute& attribute = *message.GetAttribute(static_cast<unsigned>(i));
            const std::string name = attribute.GetName();
            const bool is_tensor = name == "covariance_mm2";
            if (attribute.GetType() != (is_tensor ? igtl::PolyDataAttribute::POINT_TENSOR
                                                  : igtl::PolyDataAttribute::POINT_SCALAR) ||
                attribute.GetNumberOfComponents() != (is_tensor ? 9 : 1)) {
                throw std::runtime_error("attribute " + name + " has another type than expected");
            }
            std::vector<float>& values = all[name];
            values.resize(attribute.GetSize() * attribute.GetNumberOfComponents());
            attribute.GetData(values.data());
        }
        return all;
    }

    static void unpack_mesh(igtl::PolyDataMessage& message, ReceivedMesh& frame) {
        frame.vertices = positions(message);
        const auto polygons = message.GetPolygons();
        for (unsigned i = 0; i < polygons->GetNumberOfCells(); ++i) {
            std::list<igtlUint32> corners;
            polygons->GetCell(i, corners);
            if (corners.size() != 3) throw std::runtime_error("a polygon is no triangle");
            frame.triangles.insert(frame.triangles.end(), corners.begin(), corners.end());
        }
        auto values = attributes(message);
        frame.expected_error_mm = values["expected_error_mm"];
        frame.status = values["status"];
        frame.evidence = values["evidence"];
        frame.covariance = values["covariance_mm2"];
    }

    static void unpack_target_errors(igtl::PolyDataMessage& message, ReceivedFrame& frame) {
        frame.target_positions = positions(message);
        const auto cells = message.GetVertices();
        for (unsigned i = 0; i < cells->GetNumberOfCells(); ++i) {
            std::list<igtlUint32> cell;
            cells->GetCell(i, cell);
            if (cell != std::list<igtlUint32>{i})
                throw std::runtime_error("a target has no cell of its own");
        }
        if (3 * cells->GetNumberOfCells() != frame.target_positions.size())
            throw std::runtime_error("there are not as many cells as targets");
        auto values = attributes(message);
        frame.target_error_mm = values["expected_error_mm"];
        frame.target_covariance = values["covariance_mm2"];
    }

    static void unpack_points(igtl::PointMessage& message, std::vector<ReceivedPoint>& points) {
        for (int i = 0; i < message.GetNumberOfPointElement(); ++i) {
            igtl::PointElement::Pointer element;
            message.GetPointElement(i, element);
            ReceivedPoint point{
                element->GetName(), element->GetGroupName(), {}, element->GetRadius(), {}};
            element->GetPosition(point.xyz);
            element->GetRGBA(point.colour);
            points.push_back(point);
        }
    }

    ReadBytes read_;
    std::optional<igtl::MessageHeader::Pointer> next_header_;
    unsigned version_ = 0;
};

// A small frame with everything; its values are such that no two are equal.
inline LinkFrame example_frame(std::int64_t index = 7) {
    LinkFrame frame;
    frame.index = index;
    frame.timestamp_ns = 33'333'333 * index;
    frame.state = 1;
    frame.epoch = 2;
    frame.has_geometry = true;
    for (std::size_t i = 0; i < frame.rigid_motion.size(); ++i)
        frame.rigid_motion[i] = 0.1 + static_cast<double>(i);
    for (int i = 0; i < 12; ++i)
        frame.vertices.push_back(1.0F / static_cast<float>(i + 3) + static_cast<float>(index));
    frame.vertex_status = {0, 1, 2, 0};
    frame.vertex_evidence = {3, 1, 0, 2};
    frame.expected_error_mm = {0.1F, 0.25F, 3.3F, 1e-6F};
    for (int i = 0; i < 24; ++i)
        frame.vertex_covariance.push_back(0.01F * static_cast<float>(i) - 0.05F);
    frame.triangles = std::make_shared<const std::vector<std::uint32_t>>(
        std::vector<std::uint32_t>{0, 1, 2, 2, 1, 3});
    frame.points = {{42, "tracked", {1.5, -2.25, 60.1}, 0.3},
                    {-7, "extrapolated", {0.1, 0.2, 70.7}, 1.9}};
    frame.targets = {
        {{9'007'199'254'740'993, "extrapolated", {-3.5, 4.75, 81.3}, 0.7},
         {0.11F, -0.02F, 0.03F, 0.14F, -0.05F, 0.24F}},
        {{0, "tracked", {8.25, -9.5, 61.9}, 0.4}, {0.04F, 0.01F, -0.06F, 0.05F, 0.08F, 0.07F}}};
    return frame;
}

// The same with a surface of so many vertices that no socket's buffer takes it at once.
inline LinkFrame large_frame(std::int64_t index = 7) {
    constexpr std::size_t kVertices = 300'000;
    LinkFrame frame = example_frame(index);
    frame.vertices.assign(3 * kVertices, static_cast<float>(index));
    frame.vertex_status.assign(kVertices, 0);
    frame.vertex_evidence.assign(kVertices, 3);
    frame.expected_error_mm.assign(kVertices, 0.5F);
    frame.vertex_covariance.assign(6 * kVertices, 0.25F);
    return frame;
}

}  // namespace defrec::cli
