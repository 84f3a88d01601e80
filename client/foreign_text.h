// Text that comes from another process, before anything of the client sees it.
#pragma once

#include <google/protobuf/message.h>

namespace lucerna {

// Escapes (render/base/escape.h) every text in a message, and in the messages in it. Those that
// have several lines, failures and warnings, keep their line ends.
void EscapeTexts(google::protobuf::Message& message);

}  // namespace lucerna
