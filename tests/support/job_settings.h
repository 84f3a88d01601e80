// Changes of one setting of a job as the coordinator reports it.
#pragma once

#include <string_view>
#include <type_traits>

#include "proto/lucerna/v1/jobs.pb.h"
#include "render/wire/messages.h"

namespace lucerna {

// Any value, also one out of its range. The crop window stays.
template <typename T, typename Fields>
void SetSetting(v1::Job& job, T Fields::*field, std::type_identity_t<T> value) {
  RenderSettings settings = SettingsOf(job);
  settings.*field = value;
  *job.mutable_settings() = ToProto(settings);
}

// `message` with another text as the value of one setting.
template <typename Message>
[[nodiscard]] Message WithSettingText(Message message, std::string_view name,
                                      std::string_view text) {
  for (v1::Setting& setting : *message.mutable_settings()) {
    if (setting.name() == name) setting.set_value(std::string(text));
  }
  return message;
}

}  // namespace lucerna
