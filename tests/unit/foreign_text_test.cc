// Can any text of a coordinator reach the terminal as it came?
#include "client/foreign_text.h"

#include <string>

#include <google/protobuf/descriptor.h>
#include <gtest/gtest.h>

#include "proto/lucerna/v1/jobs.pb.h"
#include "proto/lucerna/v1/photons.pb.h"

namespace lucerna {
namespace {

const std::string kEvil = "a\x1b[2J\u202e";

// Puts kEvil into every text there is, once into each list.
void Fill(google::protobuf::Message& message, int depth = 0) {
  using google::protobuf::FieldDescriptor;
  const google::protobuf::Reflection& reflection = *message.GetReflection();
  for (int i = 0; i < message.GetDescriptor()->field_count(); ++i) {
    const FieldDescriptor* const field = message.GetDescriptor()->field(i);
    if (field->cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE && depth < 5) {
      Fill(field->is_repeated() ? *reflection.AddMessage(&message, field)
                                : *reflection.MutableMessage(&message, field),
           depth + 1);
    } else if (field->type() == FieldDescriptor::TYPE_STRING) {
      if (field->is_repeated()) {
        reflection.AddString(&message, field, kEvil);
      } else {
        reflection.SetString(&message, field, kEvil);
      }
    }
  }
}

template <typename Message>
void ExpectHarmless() {
  Message message;
  Fill(message);
  ASSERT_NE(message.SerializeAsString().find(kEvil), std::string::npos);
  EscapeTexts(message);
  const std::string bytes = message.SerializeAsString();
  EXPECT_EQ(bytes.find("\x1b["), std::string::npos);
  EXPECT_EQ(bytes.find("\u202e"), std::string::npos);
}

TEST(ForeignTextTest, NoTextOfAMessageStaysDangerous) {
  ExpectHarmless<v1::Job>();
  ExpectHarmless<v1::ListJobsResponse>();
  ExpectHarmless<v1::SubmitResponse>();
  ExpectHarmless<v1::PhotonPath>();
}

TEST(ForeignTextTest, OnlyTextsOfSeveralLinesKeepLineEnds) {
  v1::Job job;
  job.set_name("one\nforged");
  job.set_failure("a.pbrt:1:2: one\na.pbrt:3:4: two");
  job.add_warnings("one\ntwo");
  job.set_scene_digest("\x1b\n");
  EscapeTexts(job);
  EXPECT_EQ(job.name(), "one\\x0aforged");
  EXPECT_EQ(job.failure(), "a.pbrt:1:2: one\na.pbrt:3:4: two");
  EXPECT_EQ(job.warnings(0), "one\ntwo");
  EXPECT_EQ(job.scene_digest(), "\x1b\n") << "bytes are no text";
}

}  // namespace
}  // namespace lucerna
