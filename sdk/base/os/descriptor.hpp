// File descriptors that are closed with their owner: descriptor_posix.cpp, descriptor_windows.cpp.
#pragma once
#include <utility>

namespace defrec {

class Descriptor {
  public:
    Descriptor() = default;
    explicit Descriptor(int descriptor) : descriptor_(descriptor) {}
    Descriptor(Descriptor&& other) noexcept : descriptor_(std::exchange(other.descriptor_, -1)) {}
    Descriptor& operator=(Descriptor&& other) noexcept {
        Descriptor(std::move(other)).swap(*this);
        return *this;
    }
    ~Descriptor();

    int get() const { return descriptor_; }
    explicit operator bool() const { return descriptor_ >= 0; }
    void close() { Descriptor().swap(*this); }

  private:
    void swap(Descriptor& other) noexcept { std::swap(descriptor_, other.descriptor_); }
    int descriptor_ = -1;
};

// Not inherited by programs that are started. False, with errno, where there is none to be had.
struct Pipe {
    Descriptor read_end, write_end;
    bool open();
};

}  // namespace defrec
