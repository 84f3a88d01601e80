#include "client/foreign_text.h"

#include <string>
#include <vector>

#include "render/base/escape.h"

namespace lucerna {

void EscapeTexts(google::protobuf::Message& message) {
  using google::protobuf::FieldDescriptor;
  const google::protobuf::Reflection& reflection = *message.GetReflection();
  std::vector<const FieldDescriptor*> fields;
  reflection.ListFields(message, &fields);
  for (const FieldDescriptor* const field : fields) {
    const bool has_lines = field->name() == "failure" || field->name() == "warnings";
    const auto escaped = [has_lines](const std::string& text) {
      return has_lines ? EscapedLines(text) : Escaped(text);
    };
    const int count = field->is_repeated() ? reflection.FieldSize(message, field) : 0;
    if (field->cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE) {
      if (!field->is_repeated()) EscapeTexts(*reflection.MutableMessage(&message, field));
      for (int i = 0; i < count; ++i)
        EscapeTexts(*reflection.MutableRepeatedMessage(&message, field, i));
    } else if (field->type() == FieldDescriptor::TYPE_STRING) {
      if (!field->is_repeated()) {
        reflection.SetString(&message, field, escaped(reflection.GetString(message, field)));
      }
      for (int i = 0; i < count; ++i) {
        reflection.SetRepeatedString(&message, field, i,
                                     escaped(reflection.GetRepeatedString(message, field, i)));
      }
    }
  }
}

}  // namespace lucerna
