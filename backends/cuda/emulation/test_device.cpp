// See test_device.hpp.
#include "backends/cuda/emulation/test_device.hpp"

#include <cstring>
#include <optional>

#include "backends/cuda/emulation/emulated_device.hpp"

namespace defrec::under_test {
namespace {

// The stage with device buffers of its own, exactly as large as those given.
class InHostMemory final : public Stage {
  public:
    explicit InHostMemory(std::unique_ptr<cuda::Stage> stage) : stage_(std::move(stage)) {}

    void prepare(std::span<const InBuffer> in) override { stage_->prepare(in); }
    void run(std::span<const InBuffer> in, std::span<const OutBuffer> out) override {
        const std::vector<cuda::Buffer> ins = copies(in), outs = copies(out);
        cuda::Recording recording;
        cuda::Recorder recorder(recording);
        stage_->record(recorder, views<InBuffer>(ins), views<OutBuffer>(outs));
        cuda::run(recording);
        for (size_t i = 0; i < out.size(); ++i)
            if (out[i].size != 0) std::memcpy(out[i].data, outs[i].data(), out[i].size);
    }

  private:
    template <class HostBuffer>
    static std::vector<cuda::Buffer> copies(std::span<const HostBuffer> from) {
        std::vector<cuda::Buffer> result;
        for (const HostBuffer& buffer : from) {
            const bool given = buffer.data != nullptr || buffer.size != 0;
            result.push_back(given ? cuda::Buffer(device(), buffer.size) : cuda::Buffer());
            if (given) device().copy_to_device(result.back().data(), buffer.data, buffer.size);
        }
        return result;
    }
    template <class View>
    static std::vector<View> views(const std::vector<cuda::Buffer>& buffers) {
        std::vector<View> result;
        for (const cuda::Buffer& buffer : buffers) result.push_back({buffer.data(), buffer.size()});
        return result;
    }
    std::unique_ptr<cuda::Stage> stage_;
};

}  // namespace

cuda::Device& device() {
    static cuda::EmulatedDevice device;
    return device;
}

std::unique_ptr<Stage> in_host_memory(std::unique_ptr<cuda::Stage> stage) {
    return std::make_unique<InHostMemory>(std::move(stage));
}

}  // namespace defrec::under_test
