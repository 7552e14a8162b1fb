// Vectors whose memory lies on large pages where the system has them: large systems are short of address translations.
#pragma once

#include <cstdlib>
#include <new>
#include <vector>

#ifdef __linux__
#include <sys/mman.h>
#endif

namespace fesd {

template <class T>
struct LargePages {
    using value_type = T;
    static constexpr std::size_t PAGE = std::size_t(1) << 21;

    LargePages() = default;
    template <class U>
    LargePages(const LargePages<U>&) {}

    T* allocate(std::size_t count) {
        const std::size_t size = count * sizeof(T);
        const bool large = size >= PAGE;
        void* memory = large ? std::aligned_alloc(PAGE, (size + PAGE - 1) / PAGE * PAGE) : std::malloc(size);
        if (!memory) throw std::bad_alloc();
#ifdef __linux__
        if (large) madvise(memory, (size + PAGE - 1) / PAGE * PAGE, MADV_HUGEPAGE);  // may be refused
#endif
        return static_cast<T*>(memory);
    }
    void deallocate(T* memory, std::size_t) { std::free(memory); }
    template <class U>
    bool operator==(const LargePages<U>&) const { return true; }
    template <class U>
    bool operator!=(const LargePages<U>&) const { return false; }
};

template <class T>
using Memory = std::vector<T, LargePages<T>>;

}  // namespace fesd
