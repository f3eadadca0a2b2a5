// See host_plugin.hpp.
#include "plugins/base/host_plugin.hpp"

#include <atomic>
#include <string>

#include "plugins/base/computer.hpp"

namespace defrec {
namespace {

struct HostDevice {
    Host host;
    void settle() noexcept {}  // all work was done when it was enqueued
};

class HostBuffer {
  public:
    HostBuffer(const Host& host, uint64_t size)
        : memory_(host.allocate(std::max<uint64_t>(size, 1), 64), {host}),
          data_(memory_.get()),
          size_(size) {
        std::memset(data_, 0, size);
    }
    // The caller's memory.
    HostBuffer(const Host& host, void* data, uint64_t size)
        : memory_(nullptr, {host}), data_(data), size_(size) {}

    void* data() const { return data_; }
    uint64_t size() const { return size_; }
    std::byte* at(uint64_t offset) const { return static_cast<std::byte*>(data_) + offset; }

  private:
    struct Release {
        Host host;
        void operator()(void* memory) const { host.release(memory); }
    };
    std::unique_ptr<void, Release> memory_;
    void* data_;
    uint64_t size_;
};

class HostQueue {
  public:
    explicit HostQueue(HostDevice&) {}
    void write(const HostBuffer& buffer, uint64_t offset, const void* src, uint64_t size) {
        if (size != 0) std::memcpy(buffer.at(offset), src, size);
    }
    void read(const HostBuffer& buffer, uint64_t offset, void* dst, uint64_t size) {
        if (size != 0) std::memcpy(dst, buffer.at(offset), size);
    }
    uint64_t signal() { return ++signalled_; }
    bool wait(uint64_t value, uint64_t) const { return value <= signalled_; }

  private:
    std::atomic<uint64_t> signalled_{0};
};

class HostStage {
  public:
    using Buffers = std::span<const HostBuffer* const>;

    explicit HostStage(std::unique_ptr<Stage> stage) : stage_(std::move(stage)) {}
    void prepare(HostQueue&, Buffers in) { stage_->prepare(Views<InBuffer>(in)); }
    void enqueue(HostQueue&, Buffers in, Buffers out) {
        stage_->run(Views<InBuffer>(in), Views<OutBuffer>(out));
    }

  private:
    template <class View>
    class Views {
      public:
        explicit Views(Buffers buffers) : count_(buffers.size()) {
            for (size_t i = 0; i < count_; ++i)
                if (buffers[i] != nullptr) views_[i] = {buffers[i]->data(), buffers[i]->size()};
        }
        // NOLINTNEXTLINE(google-explicit-constructor): stages take spans
        operator std::span<const View>() const { return {views_.data(), count_}; }

      private:
        std::array<View, kMaxStageBuffers> views_;
        size_t count_;
    };
    std::unique_ptr<Stage> stage_;
};

class HostBackend {
  public:
    using Device = HostDevice;
    using Buffer = HostBuffer;
    using Queue = HostQueue;
    using Stage = HostStage;
    HostBackend(const HostPluginDescription& description, const defrec_host* host)
        : description_(description),
          device_name_(description.device_name != nullptr ? description.device_name
                                                          : processor_name()),
          host_(host) {}

    const char* name() const { return description_.name; }
    const char* version() const { return description_.version; }
    size_t device_count() const { return 1; }
    bool offers(uint32_t stage) const { return description_.makers[stage] != nullptr; }

    void describe(size_t, defrec_device_info& info) const {
        info.kind = DEFREC_DEVICE_CPU;
        info.id = description_.name;
        info.name = device_name_.c_str();
        info.driver = description_.version;
        info.memory_bytes = memory_bytes();
        info.features = DEFREC_FEATURE_REPEATABLE;
    }
    std::unique_ptr<HostDevice> open(size_t) const {
        return std::unique_ptr<HostDevice>(new HostDevice{host_});
    }

    HostBuffer make_buffer(HostDevice&, uint64_t size) const { return HostBuffer(host_, size); }
    HostBuffer import_buffer(HostDevice&, uint32_t kind, void* memory, uint64_t size) const {
        if (kind != DEFREC_MEMORY_HOST)
            throw StageError(DEFREC_ERROR_UNSUPPORTED,
                             std::string(name()) + " computes in the processor's memory, kind " +
                                 std::to_string(DEFREC_MEMORY_HOST) + "; kind " +
                                 std::to_string(kind) + " was given");
        return HostBuffer(host_, memory, size);
    }

    HostStage make_stage(HostDevice&, uint32_t stage, const void* params) const {
        return HostStage(description_.makers[stage](params, host_));
    }
    // The host has checked the parameters, and main memory has no limit of its own.
    void check_support(HostDevice&, uint32_t, const void*) const {}

  private:
    const HostPluginDescription& description_;
    const std::string device_name_;
    Host host_;
};

}  // namespace

defrec_status enter_host_plugin(const HostPluginDescription& description, const defrec_host* host,
                                const defrec_plugin** out) noexcept {
    return enter_plugin<HostBackend>(host, out, description, host);
}

}  // namespace defrec
