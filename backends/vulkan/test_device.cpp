// See test_device.hpp.
#include "backends/vulkan/test_device.hpp"

#include <doctest/doctest.h>

#include <optional>

namespace defrec::under_test {
namespace {

// The stage with device buffers of its own, which live from call to call as those of a tracker do.
class InHostMemory final : public Stage {
  public:
    explicit InHostMemory(std::unique_ptr<vulkan::Stage> stage) : queue_(device()), stage_(device(), std::move(stage)) {}
    ~InHostMemory() override { device().settle(); }

    void prepare(std::span<const InBuffer> in) override {
        upload(prepared_, in);
        stage_.prepare(queue_, pointers(prepared_));
    }
    void run(std::span<const InBuffer> in, std::span<const OutBuffer> out) override {
        upload(in_, in);
        upload(out_, out);
        stage_.enqueue(queue_, pointers(in_), pointers(out_));
        for (size_t i = 0; i < out.size(); ++i)
            if (out_[i]) queue_.read(*out_[i], 0, out[i].data, out[i].size);
        queue_.wait(queue_.signal(), UINT64_MAX);
    }

  private:
    using Owned = std::vector<std::optional<vulkan::Buffer>>;
    template <class HostBuffer>
    void upload(Owned& buffers, std::span<const HostBuffer> from) {
        buffers.resize(from.size());
        for (size_t i = 0; i < from.size(); ++i) {
            const bool given = from[i].data != nullptr || from[i].size != 0;
            if (buffers[i] && !(given && buffers[i]->size() == from[i].size)) {
                device().settle();  // a run that was refused has left work in the queue
                buffers[i].reset();
            }
            if (!given) continue;
            if (!buffers[i]) buffers[i].emplace(device(), from[i].size);
            queue_.write(*buffers[i], 0, from[i].data, from[i].size);
        }
    }
    static std::vector<const vulkan::Buffer*> pointers(const Owned& buffers) {
        std::vector<const vulkan::Buffer*> result;
        for (const auto& buffer : buffers) result.push_back(buffer ? &*buffer : nullptr);
        return result;
    }

    vulkan::Queue queue_;
    Owned prepared_, in_, out_;
    vulkan::RecordedStage stage_;
};

struct Opened {
    std::shared_ptr<const vulkan::Driver> driver = vulkan::Driver::open();
    size_t index = 0;
    std::unique_ptr<vulkan::Device> device;
    Opened() {
        if (driver == nullptr) return;
        while (index < driver->devices().size() && !driver->devices()[index].lacks.empty()) ++index;
        if (index < driver->devices().size()) device = std::make_unique<vulkan::Device>(driver, index);
    }
};
Opened& opened() {
    static Opened result;
    return result;
}

}  // namespace

bool available() {
    if (opened().device == nullptr) MESSAGE("skipped: no Vulkan device");
    return opened().device != nullptr;
}

vulkan::Device& device() {
    if (opened().device == nullptr) throw StageError(DEFREC_ERROR_UNSUPPORTED, "no Vulkan device");
    return *opened().device;
}

std::shared_ptr<const vulkan::Driver> driver() { return opened().driver; }
size_t device_index() { return opened().index; }

std::unique_ptr<Stage> in_host_memory(std::unique_ptr<vulkan::Stage> stage) {
    return std::make_unique<InHostMemory>(std::move(stage));
}

}  // namespace defrec::under_test
