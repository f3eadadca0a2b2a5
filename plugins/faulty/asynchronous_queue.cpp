// See asynchronous_queue.hpp. Whatever a queue claims, nothing here touches memory that is gone:
// what was to be read is copied by a thread that is in a call, and destroying a stage or a buffer
// waits for the work.
#include "plugins/faulty/asynchronous_queue.hpp"

#include <chrono>
#include <condition_variable>
#include <map>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

namespace defrec::faulty {
namespace {

constexpr auto kDelay = std::chrono::milliseconds(
    20);  // before each stage: longer than any host takes to look at the result

struct Work {
    defrec_pstage* stage;
    std::vector<defrec_pbuffer*> in, out;
};
struct Read {
    defrec_pbuffer* buffer;
    uint64_t offset;
    void* to;
    uint64_t size;
};

class Worker {
  public:
    explicit Worker(defrec_pqueue* queue) : queue_(queue), thread_([this] { work(); }) {}
    ~Worker() {
        finish();
        {
            const std::lock_guard lock(mutex_);
            stop_ = true;
        }
        changed_.notify_all();
        thread_.join();
    }
    // One piece of work at a time; the next waits for it.
    void start(Work work) {
        std::unique_lock lock(mutex_);
        changed_.wait(lock, [this] { return !busy_; });
        work_ = std::move(work);
        busy_ = true;
        changed_.notify_all();
    }
    void finish() {
        std::unique_lock lock(mutex_);
        changed_.wait(lock, [this] { return !busy_; });
    }
    void read_later(const Read& read) {
        const std::lock_guard lock(mutex_);
        reads_.push_back(read);
    }
    std::vector<Read> take_reads() {
        const std::lock_guard lock(mutex_);
        return std::exchange(reads_, {});
    }

  private:
    void work() {
        std::unique_lock lock(mutex_);
        for (;;) {
            changed_.wait(lock, [this] { return busy_ || stop_; });
            if (stop_) return;
            lock.unlock();
            std::this_thread::sleep_for(kDelay);
            good.stages[0].enqueue(work_.stage, queue_, work_.in.data(), work_.in.size(),
                                   work_.out.data(), work_.out.size());
            lock.lock();
            busy_ = false;
            changed_.notify_all();
        }
    }

    defrec_pqueue* queue_;
    std::mutex mutex_;
    std::condition_variable changed_;
    Work work_;
    std::vector<Read> reads_;
    bool busy_ = false, stop_ = false;
    std::thread thread_;
};

std::mutex workers_mutex;
std::map<defrec_pqueue*, Worker> workers;

Worker& worker_of(defrec_pqueue* queue) {
    const std::lock_guard lock(workers_mutex);
    return workers.at(queue);
}
// Gives what was to be read, as it is at present.
void give_reads(defrec_pqueue* queue, Worker& worker) {
    for (const Read& r : worker.take_reads())
        good.plugin.read(queue, r.buffer, r.offset, r.to, r.size);
}
// Ends everything asked for so far.
void finish(defrec_pqueue* queue) {
    Worker& worker = worker_of(queue);
    worker.finish();
    give_reads(queue, worker);
}
void finish_all() {
    const std::lock_guard lock(workers_mutex);
    for (auto& [queue, worker] : workers) {
        worker.finish();
        give_reads(queue, worker);
    }
}

defrec_status create_queue(defrec_pdevice* device, defrec_pqueue** out) {
    const defrec_status status = good.plugin.queue_create(device, out);
    if (status != DEFREC_OK) return status;
    const std::lock_guard lock(workers_mutex);
    workers.try_emplace(*out, *out);
    return status;
}
void destroy_queue(defrec_pqueue* queue) {
    {
        const std::lock_guard lock(workers_mutex);
        workers.erase(queue);
    }
    good.plugin.queue_destroy(queue);
}
defrec_status enqueue(defrec_pstage* stage, defrec_pqueue* queue, defrec_pbuffer* const* in,
                      size_t in_count, defrec_pbuffer* const* out, size_t out_count) {
    worker_of(queue).start({stage, {in, in + in_count}, {out, out + out_count}});
    return DEFREC_OK;
}
defrec_status prepare(defrec_pstage* stage, defrec_pqueue* queue, defrec_pbuffer* const* in,
                      size_t in_count) {
    finish(queue);
    return good.stages[DEFREC_STAGE_WARP].prepare(stage, queue, in, in_count);
}
defrec_status write(defrec_pqueue* queue, defrec_pbuffer* buffer, uint64_t offset, const void* src,
                    uint64_t size) {
    finish(queue);
    return good.plugin.write(queue, buffer, offset, src, size);
}
defrec_status read(defrec_pqueue* queue, defrec_pbuffer* buffer, uint64_t offset, void* dst,
                   uint64_t size) {
    const defrec_status status =
        good.plugin.read(queue, buffer, offset, dst, size);  // now, for its checks
    if (status == DEFREC_OK) worker_of(queue).read_later({buffer, offset, dst, size});
    return status;
}
defrec_status wait_until_done(defrec_pqueue* queue, uint64_t value, uint64_t timeout_ns) {
    finish(queue);
    return good.plugin.wait(queue, value, timeout_ns);
}
defrec_status wait_not_at_all(defrec_pqueue* queue, uint64_t value, uint64_t timeout_ns) {
    give_reads(queue, worker_of(queue));
    return good.plugin.wait(queue, value, timeout_ns);
}

}  // namespace

void make_asynchronous(Tables& tables, Wait mode) {
    tables.plugin.queue_create = create_queue;
    tables.plugin.queue_destroy = destroy_queue;
    tables.plugin.write = write;
    tables.plugin.read = read;
    tables.plugin.wait = mode == Wait::until_done ? wait_until_done : wait_not_at_all;
    tables.plugin.buffer_destroy = [](defrec_pbuffer* buffer) {
        finish_all();
        good.plugin.buffer_destroy(buffer);
    };
    for (defrec_stage_table& stage : tables.stages) {
        if (stage.prepare != nullptr) stage.prepare = prepare;
        stage.enqueue = enqueue;
        stage.destroy = [](defrec_pstage* object) {
            finish_all();
            good.stages[0].destroy(object);
        };
    }
}

}  // namespace defrec::faulty
