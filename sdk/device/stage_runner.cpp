// See stage_runner.hpp.
#include "sdk/device/stage_runner.hpp"

namespace defrec {
namespace {

// Takes both kinds of the C API's buffers. needed(i): bytes that buffer i must have.
template <class Buffer, class Needed>
void check_buffers(const char* what, const Buffer* buffers, size_t count, Needed needed) {
    if (count > DeviceStage::kMaxBuffers)
        fail(DEFREC_ERROR_ARGUMENT, what, ": ", count, " buffers given, at most ",
             int{DeviceStage::kMaxBuffers}, " expected");
    if (buffers == nullptr && count != 0)
        fail(DEFREC_ERROR_ARGUMENT, what, " is NULL with a count of ", count);
    for (size_t i = 0; i < count; ++i) {
        if (buffers[i].data == nullptr) {
            if (buffers[i].size != 0)
                fail(DEFREC_ERROR_ARGUMENT, what, "[", i, "].data is NULL with a size of ",
                     buffers[i].size);
        } else if (buffers[i].size < needed(i)) {
            fail(DEFREC_ERROR_ARGUMENT, what, "[", i, "] has ", buffers[i].size, " bytes, ",
                 needed(i), " are needed");
        } else if (buffers[i].size > PTRDIFF_MAX) {
            fail(DEFREC_ERROR_ARGUMENT, what, "[", i, "].size is ", buffers[i].size,
                 ", more than any memory has");
        }
    }
}

}  // namespace

StageRunner::StageRunner(std::shared_ptr<const Device> device, const StageParams& params)
    : params_(params),
      device_(std::move(device)),
      queue_(device_),
      stage_(device_, params_.stage(), params_.get()),
      needs_prepare_(device_->stage_table(params_.stage())->prepare != nullptr) {}

// The device's buffer has the caller's size exactly: some stages count their records by it.
void StageRunner::upload(Buffers& buffers, size_t index, const void* data, uint64_t size) {
    DeviceBuffer& buffer = buffers[index];
    if (data == nullptr) {
        buffer = DeviceBuffer();
        return;
    }
    if (buffer.size() != size || !buffer) buffer = DeviceBuffer(device_, size);
    if (size != 0) queue_.write(buffer, data, size);
}

std::vector<const DeviceBuffer*> StageRunner::given(const Buffers& buffers, size_t count) {
    std::vector<const DeviceBuffer*> pointers(count);
    for (size_t i = 0; i < count; ++i) pointers[i] = buffers[i] ? &buffers[i] : nullptr;
    return pointers;
}

void StageRunner::prepare(const defrec_const_buffer* in, size_t in_count) {
    check_buffers("in", in, in_count, [](size_t) { return uint64_t{0}; });
    prepared_.resize(std::max(prepared_.size(), in_count));
    for (size_t i = 0; i < in_count; ++i) upload(prepared_, i, in[i].data, in[i].size);
    stage_.prepare(queue_, given(prepared_, in_count));
    queue_.finish();
    needs_prepare_ = false;
}

void StageRunner::run(const defrec_const_buffer* in, size_t in_count, const defrec_buffer* out,
                      size_t out_count) {
    if (needs_prepare_)
        fail(DEFREC_ERROR_STATE, "the stage ", stage_name(params_.stage()),
             " needs defrec_stage_prepare before its first run");
    check_buffers("in", in, in_count, [this](size_t i) { return params_.input_bytes(i); });
    check_buffers("out", out, out_count, [this](size_t i) { return params_.output_bytes(i); });
    in_.resize(std::max(in_.size(), in_count));
    out_.resize(std::max(out_.size(), out_count));
    for (size_t i = 0; i < in_count; ++i) upload(in_, i, in[i].data, in[i].size);
    // Up as well, so that bytes which the stage leaves alone come back as they were.
    for (size_t i = 0; i < out_count; ++i) upload(out_, i, out[i].data, out[i].size);
    stage_.enqueue(queue_, given(in_, in_count), given(out_, out_count));
    queue_.finish();
    for (size_t i = 0; i < out_count; ++i)
        if (out[i].data != nullptr && out[i].size != 0)
            queue_.read(out_[i], out[i].data, out[i].size);
    queue_.finish();
}

}  // namespace defrec
