// A template's data in buffers of a device.
#pragma once
#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "sdk/device/device.hpp"
#include "sdk/template/template.hpp"

namespace defrec {

inline constexpr uint64_t kMinBufferBytes = 16;  // whatever a template lacks

template <class T>
uint64_t bytes_of(const T& values) {
    return std::span(values).size_bytes();
}

template <class T>
uint32_t count_of(const std::vector<T>& values) {
    return static_cast<uint32_t>(values.size());
}

inline uint32_t node_count(const TemplateData& data) { return count_of(data.nodes) / 3; }

template <class T>
DeviceBuffer buffer_of(const Queue& queue, uint64_t count) {
    return {queue.device(), std::max<uint64_t>(count * sizeof(T), kMinBufferBytes)};
}

template <class T>
DeviceBuffer buffer_for(const Queue& queue, const std::vector<T>& values) {
    return buffer_of<T>(queue, values.size());
}

template <class T>
void write_all(Queue& queue, const DeviceBuffer& buffer, const std::vector<T>& values) {
    if (!values.empty()) queue.write(buffer, values.data(), bytes_of(values));
}

template <class T>
DeviceBuffer uploaded(Queue& queue, const std::vector<T>& values) {
    DeviceBuffer buffer = buffer_for(queue, values);
    write_all(queue, buffer, values);
    return buffer;
}

}  // namespace defrec
