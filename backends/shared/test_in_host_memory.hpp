// A device's stage in the shape of host-memory backends, so that the same tests hold every backend
// to the reference (backends/agreement).
#pragma once
#include <optional>

#include "backends/shared/stage.hpp"

namespace defrec::test {

// The stage with device buffers of its own, which live from call to call as those of a tracker do.
// Types: Device, Buffer, Queue and Stage, as plugins/base/plugin.hpp wants them of a backend.
template <class Types>
class InHostMemory final : public Stage {
  public:
    template <class DeviceStage>
    InHostMemory(typename Types::Device& device, std::unique_ptr<DeviceStage> stage)
        : device_(device), queue_(device), stage_(device, std::move(stage)) {}
    ~InHostMemory() override { device_.settle(); }

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
    using Buffer = typename Types::Buffer;
    using Owned = std::vector<std::optional<Buffer>>;
    template <class HostBuffer>
    void upload(Owned& buffers, std::span<const HostBuffer> from) {
        buffers.resize(from.size());
        for (size_t i = 0; i < from.size(); ++i) {
            const bool given = from[i].data != nullptr || from[i].size != 0;
            if (buffers[i] && !(given && buffers[i]->size() == from[i].size)) {
                device_.settle();  // a run that was refused has left work in the queue
                buffers[i].reset();
            }
            if (!given) continue;
            if (!buffers[i]) buffers[i].emplace(device_, from[i].size);
            queue_.write(*buffers[i], 0, from[i].data, from[i].size);
        }
    }
    static std::vector<const Buffer*> pointers(const Owned& buffers) {
        std::vector<const Buffer*> result;
        for (const auto& buffer : buffers) result.push_back(buffer ? &*buffer : nullptr);
        return result;
    }

    typename Types::Device& device_;
    typename Types::Queue queue_;
    Owned prepared_, in_, out_;
    typename Types::Stage stage_;
};

}  // namespace defrec::test
