// See stage_job.hpp.
#include "conformance/worker/stage_job.hpp"

#include <algorithm>

namespace defrec::conformance {
namespace {

constexpr uint64_t kBehind = 160;  // bytes of an output's buffer behind what is needed
constexpr uint64_t kFillSeed =
    77;  // one for all runs: what one finds is the complement of what the next finds

// Something without pattern; the complement differs from it in every byte.
Bytes fill(uint64_t size, uint64_t seed, bool complement) {
    Bytes bytes(size);
    Random random(seed);
    uint64_t bits = 0;
    for (uint64_t i = 0; i < size; ++i, bits >>= 8) {
        if (i % 8 == 0) bits = random.next();
        bytes[i] = std::byte(uint8_t(complement ? ~bits : bits));
    }
    return bytes;
}

// The image with something else where nobody may look, behind it too.
Bytes with_garbage(const Input& input, uint64_t seed) {
    if (input.stride == 0) return input.bytes;
    Bytes bytes = fill(input.bytes.size() + 64, seed, false);
    for (uint64_t start = 0; start < input.bytes.size(); start += input.stride)
        std::copy_n(input.bytes.begin() + std::ptrdiff_t(start),
                    std::min(input.row, input.bytes.size() - start),
                    bytes.begin() + std::ptrdiff_t(start));
    return bytes;
}

std::vector<Buffer> upload(const Session& session, Queue& queue, const std::vector<Bytes>& contents,
                           const std::vector<bool>& given) {
    std::vector<Buffer> buffers;
    for (size_t i = 0; i < contents.size(); ++i) {
        buffers.push_back(given[i] ? Buffer(session, contents[i].size()) : Buffer());
        if (given[i] && !contents[i].empty()) queue.write(buffers.back(), contents[i]);
    }
    return buffers;
}

// One run of a job: what lies in its buffers before, the buffers, and what is read back afterwards.
class DeviceRun {
  public:
    // seed: of what surrounds the inputs.
    DeviceRun(const Session& session, Queue& queue, const StageJob& job, uint64_t seed,
              bool complement)
        : job_(job) {
        std::vector<bool> given;
        for (const Input& input : job.prepare) {
            prepared_before_.push_back(with_garbage(input, seed));
            given.push_back(input.given);
        }
        prepared_ = upload(session, queue, prepared_before_, given);
        given.clear();
        for (const Input& input : job.in) {
            in_before_.push_back(with_garbage(input, seed));
            given.push_back(input.given);
        }
        in_ = upload(session, queue, in_before_, given);
        given.clear();
        for (const Output& output : job.out) {
            before.push_back(fill(output.given ? output.size + kBehind : 0, kFillSeed, complement));
            given.push_back(output.given);
        }
        out_ = upload(session, queue, before, given);
    }

    void enqueue(Queue& queue, Stage& stage) {
        if (!job_.prepare.empty() && job_.prepared) stage.prepare(queue, prepared_);
        // What prepare has read may change.
        for (size_t i = 0; i < prepared_.size(); ++i)
            if (!prepared_before_[i].empty() && prepared_[i].get() != nullptr)
                queue.write(prepared_[i], fill(prepared_before_[i].size(), kFillSeed, true));
        stage.enqueue(queue, in_, out_);
        for (size_t i = 0; i < prepared_.size(); ++i)
            if (!prepared_before_[i].empty() && prepared_[i].get() != nullptr)
                queue.write(prepared_[i], prepared_before_[i]);
    }

    void read(Queue& queue) {
        read_all(queue, out_, after);
        read_all(queue, in_, in_after_);
        read_all(queue, prepared_, prepared_after_);
    }

    // After the queue has finished.
    void check_inputs() const {
        const auto check = [&](const char* what, const std::vector<Buffer>& buffers,
                               const std::vector<Bytes>& was, const std::vector<Bytes>& is) {
            for (size_t i = 0; i < was.size(); ++i)
                require(buffers[i].get() == nullptr || was[i] == is[i], stage_name(job_.stage()),
                        " changed its ", what, " ", i);
        };
        check("input", in_, in_before_, in_after_);
        check("prepared input", prepared_, prepared_before_, prepared_after_);
    }

    // The outputs without what lies behind them.
    std::vector<Bytes> results() const {
        std::vector<Bytes> outputs = after;
        for (size_t i = 0; i < outputs.size(); ++i)
            if (job_.out[i].given) outputs[i].resize(job_.out[i].size);
        return outputs;
    }

    std::vector<Bytes> before, after;  // of the outputs

  private:
    static void read_all(Queue& queue, const std::vector<Buffer>& buffers,
                         std::vector<Bytes>& contents) {
        contents.resize(buffers.size());
        for (size_t i = 0; i < buffers.size(); ++i) {
            contents[i].resize(buffers[i].get() == nullptr ? 0 : buffers[i].size());
            if (!contents[i].empty()) queue.read(buffers[i], contents[i]);
        }
    }

    const StageJob& job_;
    std::vector<Bytes> prepared_before_, prepared_after_, in_before_, in_after_;
    std::vector<Buffer> prepared_, in_, out_;
};

std::string place(const Output& output, uint64_t byte) {
    if (byte >= output.size) return concat("byte ", byte - output.size, " behind the end");
    if (output.width == 0)
        return concat("byte ", byte % output.element, " of record ", byte / output.element);
    const uint64_t element = byte / output.element, x = element % output.stride,
                   y = element / output.stride;
    return x < output.width ? concat("the element at (", x, ", ", y, ")")
                            : concat("byte ", byte, ", between rows ", y, " and ", y + 1, ",");
}

// Written bytes are the same whatever lay there; others are what lay there.
void check_writes(const StageJob& job, const DeviceRun& first, const DeviceRun& second,
                  const Expected& expected) {
    for (size_t i = 0; i < job.out.size(); ++i) {
        if (!job.out[i].given) continue;
        for (uint64_t byte = 0; byte < first.after[i].size(); ++byte) {
            const bool untouched = first.after[i][byte] == first.before[i][byte] &&
                                   second.after[i][byte] == second.before[i][byte];
            if (byte < expected.written[i].size() && expected.written[i][byte]) {
                require(!untouched, stage_name(job.stage()), " left ", place(job.out[i], byte),
                        " of ", job.out[i].name, " as it was");
            } else {
                require(untouched, stage_name(job.stage()), " wrote ", place(job.out[i], byte),
                        " of ", job.out[i].name, ", which is to stay as it was");
            }
        }
    }
}

}  // namespace

Expected run_reference(Session& reference, const StageJob& job) {
    Queue queue(reference);
    DeviceRun first(reference, queue, job, 1, false), second(reference, queue, job, 1, true);
    Stage stage(reference, job.stage(), job.params.get());
    first.enqueue(queue, stage);
    second.enqueue(queue, stage);
    first.read(queue);
    second.read(queue);
    queue.finish();
    Expected expected;
    expected.outputs = first.results();
    for (size_t i = 0; i < job.out.size(); ++i) {
        std::vector<bool> written(expected.outputs[i].size());
        for (size_t byte = 0; byte < written.size(); ++byte)
            written[byte] = first.after[i][byte] == second.after[i][byte];
        expected.written.push_back(std::move(written));
    }
    return expected;
}

std::vector<Bytes> run_plainly(Session& session, const StageJob& job) {
    Queue queue(session);
    DeviceRun run(session, queue, job, 1, false);
    Stage stage(session, job.stage(), job.params.get());
    run.enqueue(queue, stage);
    run.read(queue);
    queue.finish();
    return run.results();
}

Found run_strictly(Session& session, const StageJob& job, const StageJob& other,
                   const Expected& expected) {
    Queue queue(session);
    DeviceRun first(session, queue, job, 1, false), between(session, queue, other, 2, false),
        second(session, queue, job, 3, true);
    Stage stage(session, job.stage(), job.params.get());
    first.enqueue(queue, stage);
    between.enqueue(queue, stage);
    second.enqueue(queue, stage);
    first.read(queue);
    between.read(queue);
    second.read(queue);
    queue.finish();
    first.check_inputs();
    between.check_inputs();
    second.check_inputs();
    check_writes(job, first, second, expected);
    return {first.results(), second.results()};
}

}  // namespace defrec::conformance
