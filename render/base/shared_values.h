// Which values that follow from a key alone are in memory already?
//
// For tables that take long to make and are the same wherever they are made: whoever needs one
// while another still has it shares that one.
#pragma once

#include <map>
#include <memory>

#include "render/base/mutex.h"

namespace lucerna {

template <typename Key, typename Value>
class SharedValues {
 public:
  // nullptr when nobody has the value of this key. Any thread.
  [[nodiscard]] std::shared_ptr<const Value> Find(const Key& key) const {
    const MutexLock lock(mutex_);
    const auto found = values_.find(key);
    return found == values_.end() ? nullptr : found->second.lock();
  }
  // From here on others find the value, as long as somebody has it. Any thread.
  void Share(const Key& key, const std::shared_ptr<const Value>& value) {
    const MutexLock lock(mutex_);
    std::erase_if(values_, [](const auto& entry) { return entry.second.expired(); });
    values_[key] = value;
  }

 private:
  mutable Mutex mutex_;
  std::map<Key, std::weak_ptr<const Value>> values_ LUCERNA_GUARDED_BY(mutex_);
};

}  // namespace lucerna
