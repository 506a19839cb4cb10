// The types of shapes.idl for Fast DDS 2.9, written by hand: no generator, and so no Java, is needed.
//
// All of them are held in one struct; which members count, and how they lie on the wire, the kind decides.
// Fast DDS 2.9 encodes XCDR1 only, where an appendable struct lies as a final one does.
#ifndef FASTDDS_TYPES_HPP
#define FASTDDS_TYPES_HPP

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include <fastcdr/Cdr.h>
#include <fastcdr/FastBuffer.h>
#include <fastdds/dds/topic/TopicDataType.hpp>
#include <fastrtps/utils/md5.h>

#include "payload.h"

namespace rtps = eprosima::fastrtps::rtps;
using eprosima::fastcdr::Cdr;
using eprosima::fastcdr::FastBuffer;

struct Sample
{
    std::string color;
    uint8_t tint = 0;
    double angle = 0;
    int64_t stamp = 0;
    int32_t x = 0, y = 0, shapesize = 0;
    int32_t id = 0;
    std::vector<uint8_t> data;
};

class SampleSupport : public eprosima::fastdds::dds::TopicDataType
{
public:

    explicit SampleSupport(enum kind kind)
        : kind_(kind)
    {
        static const char* const names[] = {"ShapeType", "PlainShape", "OpenShape", "Blob", "KeyedBlob"};
        setName(names[kind]);
        m_typeSize = is_blob() ? 64 : 4 + 4 + 132 + 40; // a first size; blobs grow beyond it
        m_isGetKeyDefined = kind == SHAPE || kind == OPEN || kind == KEYED_BLOB;
    }

    bool serialize(void* data, rtps::SerializedPayload_t* payload) override
    {
        const Sample& s = *static_cast<Sample*>(data);
        FastBuffer buffer(reinterpret_cast<char*>(payload->data), payload->max_size);
        Cdr cdr(buffer, Cdr::DEFAULT_ENDIAN, Cdr::DDS_CDR);
        payload->encapsulation = cdr.endianness() == Cdr::BIG_ENDIANNESS ? CDR_BE : CDR_LE;
        cdr.serialize_encapsulation();
        if (is_blob())
        {
            cdr << s.id << s.data;
        }
        else if (kind_ == OPEN)
        {
            cdr << s.color << s.tint << s.angle << s.stamp << s.x << s.y << s.shapesize;
        }
        else
        {
            cdr << s.color << s.x << s.y << s.shapesize;
        }
        payload->length = static_cast<uint32_t>(cdr.getSerializedDataLength());
        return true;
    }

    bool deserialize(rtps::SerializedPayload_t* payload, void* data) override
    {
        try
        {
            Sample& s = *static_cast<Sample*>(data);
            FastBuffer buffer(reinterpret_cast<char*>(payload->data), payload->length);
            Cdr cdr(buffer, Cdr::DEFAULT_ENDIAN, Cdr::DDS_CDR);
            cdr.read_encapsulation();
            if (is_blob())
            {
                cdr >> s.id >> s.data;
            }
            else if (kind_ == OPEN)
            {
                cdr >> s.color >> s.tint >> s.angle >> s.stamp >> s.x >> s.y >> s.shapesize;
            }
            else
            {
                cdr >> s.color >> s.x >> s.y >> s.shapesize;
            }
            return true;
        }
        catch (const eprosima::fastcdr::exception::Exception&)
        {
            return false;
        }
    }

    std::function<uint32_t()> getSerializedSizeProvider(void* data) override
    {
        return [this, data]() -> uint32_t
               {
                   const Sample& s = *static_cast<Sample*>(data);
                   return static_cast<uint32_t>(is_blob() ? 16 + s.data.size() : 80 + s.color.size());
               };
    }

    // RTPS 2.5 9.6.4.8: the key's big-endian CDR itself where it never exceeds 16 octets, else its MD5.
    bool getKey(void* data, rtps::InstanceHandle_t* handle, bool) override
    {
        if (!m_isGetKeyDefined)
        {
            return false;
        }
        const Sample& s = *static_cast<Sample*>(data);
        char octets[160] = {0};
        FastBuffer buffer(octets, sizeof octets);
        Cdr cdr(buffer, Cdr::BIG_ENDIANNESS);
        if (is_blob())
        {
            cdr << s.id;
            memcpy(&handle->value[0], octets, 16);
            return true;
        }
        cdr << s.color;
        MD5 md5;
        md5.init();
        md5.update(octets, static_cast<unsigned>(cdr.getSerializedDataLength()));
        md5.finalize();
        memcpy(&handle->value[0], md5.digest, 16);
        return true;
    }

    void* createData() override
    {
        return new Sample;
    }

    void deleteData(void* data) override
    {
        delete static_cast<Sample*>(data);
    }

private:

    bool is_blob() const
    {
        return kind_ == BLOB || kind_ == KEYED_BLOB;
    }

    enum kind kind_;
};

#endif
