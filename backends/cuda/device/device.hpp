// What stages need of a device: memory, and how large it is. Gpu (gpu.hpp) is one that CUDA drives,
// EmulatedDevice (emulation/) one that the processor plays.
#pragma once
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace defrec::cuda {

struct Limits {
    uint32_t multiprocessors;
    uint32_t shared_per_block;           // bytes, the most that a kernel may ask for
    uint32_t shared_per_multiprocessor;  // bytes
    uint32_t compute_capability;         // 10 * major + minor
};

// Outlives everything made from it. threads: any.
class Device {
  public:
    virtual ~Device() = default;
    virtual const Limits& limits() const = 0;
    // 256-byte aligned; never nullptr. Throws StageError(DEFREC_ERROR_OUT_OF_MEMORY).
    virtual std::byte* allocate(uint64_t size) = 0;
    // What used the memory must have ended.
    virtual void release(std::byte* memory) noexcept = 0;
    // These wait.
    virtual void copy_to_device(std::byte* to, const void* from, uint64_t size) = 0;
    virtual void clear(std::byte* memory, uint64_t size) = 0;
    // How many blocks of a kernel the device holds at once: the most that a cooperative grid may
    // have. function: of a KernelCall.
    virtual uint32_t resident_blocks(const void* function, uint32_t threads,
                                     size_t shared) const = 0;
    // Whether so many of them can be a cluster.
    virtual bool holds_cluster(const void* function, uint32_t blocks, uint32_t threads,
                               size_t shared) const = 0;
};

// A number that nothing else in this process has.
inline uint64_t next_serial() {
    static std::atomic<uint64_t> serials{0};
    return ++serials;
}

// Memory of a device. What is in it is not defined until somebody writes.
class Buffer {
  public:
    Buffer() = default;
    Buffer(Device& device, uint64_t size)
        : device_(&device), data_(device.allocate(size)), size_(size), serial_(next_serial()) {}
    Buffer(Buffer&& other) noexcept { swap(other); }
    Buffer& operator=(Buffer&& other) noexcept {
        Buffer(std::move(other)).swap(*this);
        return *this;
    }
    ~Buffer() {
        if (device_ != nullptr) device_->release(data_);
    }
    // Memory that somebody else owns.
    static Buffer borrowed(void* memory, uint64_t size) {
        Buffer buffer;
        buffer.data_ = static_cast<std::byte*>(memory);
        buffer.size_ = size;
        buffer.serial_ = next_serial();
        return buffer;
    }

    explicit operator bool() const { return data_ != nullptr; }
    std::byte* data() const { return data_; }
    uint64_t size() const { return size_; }
    // Tells it from another that had its address before: what the driver has made for one does not
    // work on the other.
    uint64_t serial() const { return serial_; }
    template <class T>
    T* as() const {
        return reinterpret_cast<T*>(data_);
    }

  private:
    void swap(Buffer& other) noexcept {
        std::swap(device_, other.device_);
        std::swap(data_, other.data_);
        std::swap(size_, other.size_);
        std::swap(serial_, other.serial_);
    }
    Device* device_ = nullptr;
    std::byte* data_ = nullptr;
    uint64_t size_ = 0, serial_ = 0;
};

// count elements of T.
template <class T>
Buffer make_buffer(Device& device, uint64_t count) {
    return Buffer(device, count * sizeof(T));
}
// A buffer with these bytes in it.
template <class T>
Buffer upload(Device& device, const std::vector<T>& values) {
    Buffer buffer = make_buffer<T>(device, values.size());
    device.copy_to_device(buffer.data(), values.data(), values.size() * sizeof(T));
    return buffer;
}

}  // namespace defrec::cuda
